/* Expanding an L-system and walking its final string. */
#ifndef RT_NODE_TREE_LSYSTEM_H
#define RT_NODE_TREE_LSYSTEM_H

#include "common/affine.h"
#include "common/err.h"
#include "node/tree/grammar.h"

/* Called for each drawn symbol in the order of the string: meaning is SYMBOL_TRUNK or SYMBOL_LEAF, place maps the
 * trunk's or leaf's node (its own matrix applied before) to the tree's space. False stops the walk. */
typedef bool (*LsystemDraw)(void *context, SymbolMeaning meaning, const Affine *place);

/* The fewest symbols that are visited and drawn, whatever is drawn of the rules: they tell at once of a string that is far
 * too long. UINT64_MAX stands for more. False and *err: ERR_LIMIT without memory. */
typedef struct { uint64_t visited, drawn; } LsystemCount;
bool lsystem_fewest(const Grammar *grammar, uint32_t depth, LsystemCount *fewest, Err *err);

/* Replaces `depth` times every symbol that has a rule, each by its own draw from `seed`, and walks the result.
 * Memory is proportional to the depth, not to the length of the string, as far as the grammar permits.
 * False and *err: ERR_LIMIT if more than `limit` symbols would be drawn or visited (the text names the limit),
 * ERR_SCENE if a bracket of the final string doesn't pair; false with *err alone if `draw` returned false. */
bool lsystem_walk(const Grammar *grammar, uint32_t depth, uint64_t seed, uint64_t limit, LsystemDraw draw, void *context,
                  Err *err);

#endif
