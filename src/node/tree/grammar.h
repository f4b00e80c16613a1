/* L-system grammars (SPEC 8): reading a .grammar file. */
#ifndef RT_NODE_TREE_GRAMMAR_H
#define RT_NODE_TREE_GRAMMAR_H

#include <stdbool.h>
#include <stdint.h>

#include "common/affine.h"
#include "common/err.h"

typedef enum {
    SYMBOL_NOTHING,  /* draws nothing: has rules only */
    SYMBOL_TRUNK,
    SYMBOL_LEAF,
    SYMBOL_OPEN,     /* bracket */
    SYMBOL_CLOSE,
} SymbolMeaning;

typedef struct {
    double probability;
    uint32_t first, count;     /* of Grammar.body: the symbols it puts in */
} Rule;

typedef struct {
    const char *name;
    SymbolMeaning meaning;
    double size[3];            /* SYMBOL_TRUNK, SYMBOL_LEAF: sx sy sz */
    Affine turn;               /* SYMBOL_OPEN: x, then y, then z */
    uint32_t pair;             /* SYMBOL_OPEN, SYMBOL_CLOSE: the other bracket's symbol */
    uint32_t first_rule, rule_count;  /* of Grammar.rule; brackets may have none */
} Symbol;

typedef struct Grammar {
    Symbol *symbol;
    uint32_t symbol_count;
    Rule *rule;                /* those of one symbol stand together, in the order of the file */
    uint32_t rule_count;
    uint32_t *body;
    uint32_t start;
    void *memory;              /* private */
} Grammar;

/* NULL and *err: ERR_INPUT "file.grammar:LINE: what", ERR_LIMIT. */
Grammar *grammar_load(const char *path, Err *err);
void grammar_destroy(Grammar *grammar);

typedef struct {
    const char *path;   /* as resolved */
    Grammar *loaded;    /* NULL until needed; owned */
} GrammarSource;

bool grammar_source_load(GrammarSource *source, Err *err);

#endif
