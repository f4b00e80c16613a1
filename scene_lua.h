/* Runs a scene script: the commands of the table `gr` build a scene tree, and gr.render hands it to a sink. */
#ifndef RT_SCENE_LUA_H
#define RT_SCENE_LUA_H

#include <stdbool.h>

#include "common/err.h"
#include "scene/job.h"

typedef struct {
    const char *script;            /* path of the scene */
    const char *const *args;       /* the script's arg[1], arg[2], ... */
    int arg_count;
    const char *const *include;    /* -I directories, looked in last */
    int include_count;
    bool legacy;                   /* scripts of 2015 and before: post-multiplied transforms, Lua 5.1 names */
} SceneScript;

/* False and *err: ERR_INPUT if the script can't be opened, ERR_SCENE for its mistakes, or the sink's own error. */
bool scene_lua_run(const SceneScript *script, const RenderSink *sink, Err *err);

#endif
