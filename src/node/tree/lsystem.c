/* The string is never written out: a stack has, for each level of replacement, how far its body has been read, and the
 * symbols come out depth first, in order. One sequence of random numbers is drawn from in that order. */
#include "node/tree/lsystem.h"

#include <inttypes.h>
#include <stdlib.h>

#include "common/rng.h"

enum { FIRST_CAPACITY = 64, RNG_STREAM = 8 };

/* A body that is being read: depth levels of replacement are left for its symbols. */
typedef struct {
    const uint32_t *at, *end;
    uint32_t depth;
} Level;

/* A bracket that is open, and the end that its closing comes back to. */
typedef struct {
    Affine end;
    uint32_t bracket;
} Opened;

typedef struct {
    const Grammar *grammar;
    Rng rng;
    uint64_t visited, limit;
    Affine end;  /* of the symbol drawn last: where the next one stands, and how it is turned */
    Level *level;
    Opened *opened;
    size_t level_count, level_capacity, opened_count, opened_capacity;
    LsystemDraw draw;
    void *context;
    Err *err;
} Walk;

static void *make_room(Walk *w, void *array, size_t count, size_t *capacity, size_t element)
{
    if (count < *capacity) return array;
    size_t more = *capacity ? 2 * *capacity : FIRST_CAPACITY;
    void *larger = realloc(array, more * element);
    if (larger)
        *capacity = more;
    else
        err_memory(w->err, "an L-system");
    return larger;
}

static bool push_level(Walk *w, const uint32_t *at, uint32_t count, uint32_t depth)
{
    Level *level = make_room(w, w->level, w->level_count, &w->level_capacity, sizeof *level);
    if (!level) return false;
    w->level = level;
    level[w->level_count++] = (Level){at, at + count, depth};
    return true;
}

/* Draws one of the rules of a symbol; NULL where it disappears. */
static const Rule *choose_rule(Walk *w, const Symbol *symbol)
{
    double draw = rng_double(&w->rng), sum = 0;
    const Rule *rule = w->grammar->rule + symbol->first_rule;
    for (uint32_t i = 0; i < symbol->rule_count; i++) {
        sum += rule[i].probability;
        if (draw < sum) return &rule[i];
    }
    return NULL;
}

static bool open_bracket(Walk *w, uint32_t s)
{
    Opened *opened = make_room(w, w->opened, w->opened_count, &w->opened_capacity, sizeof *opened);
    if (!opened) return false;
    w->opened = opened;
    opened[w->opened_count++] = (Opened){w->end, s};
    w->end = affine_mul(&w->end, &w->grammar->symbol[s].turn);
    return true;
}

static bool close_bracket(Walk *w, uint32_t s)
{
    const Symbol *symbol = &w->grammar->symbol[s];
    if (w->opened_count == 0 || w->opened[w->opened_count - 1].bracket != symbol->pair)
        return err_set(w->err, ERR_SCENE, "the bracket '%s' closes none that is open", symbol->name);
    w->end = w->opened[--w->opened_count].end;
    return true;
}

/* The symbol's origin is put sy above the end; the new end is 2 sy above the old one. */
static bool draw_symbol(Walk *w, const Symbol *symbol)
{
    Affine place;
    for (int i = 0; i < 3; i++) {
        double *end = w->end.m[i], step = symbol->size[1] * end[1];
        for (int j = 0; j < 3; j++) place.m[i][j] = end[j] * symbol->size[j];
        place.m[i][3] = end[3] + step;
        end[3] += 2 * step;
    }
    return w->draw(w->context, symbol->meaning, &place);
}

static bool interpret(Walk *w, uint32_t s)
{
    const Symbol *symbol = &w->grammar->symbol[s];
    switch (symbol->meaning) {
    case SYMBOL_NOTHING: return true;
    case SYMBOL_TRUNK:
    case SYMBOL_LEAF: return draw_symbol(w, symbol);
    case SYMBOL_OPEN: return open_bracket(w, s);
    case SYMBOL_CLOSE: return close_bracket(w, s);
    }
    return true;
}

static bool visit(Walk *w, uint32_t s, uint32_t depth)
{
    if (++w->visited > w->limit)
        return err_set(w->err, ERR_LIMIT, "the L-system has more than the limit of %" PRIu64 " symbols", w->limit);
    const Symbol *symbol = &w->grammar->symbol[s];
    if (depth == 0 || symbol->rule_count == 0) return interpret(w, s);
    const Rule *rule = choose_rule(w, symbol);
    return !rule || rule->count == 0 || push_level(w, w->grammar->body + rule->first, rule->count, depth - 1);
}

/* A level that has been read is popped before its last symbol is visited, so a chain of single replacements takes no
 * more room than one of them. */
static bool walk(Walk *w)
{
    while (w->level_count > 0) {
        Level *level = &w->level[w->level_count - 1];
        if (level->at == level->end) {
            w->level_count--;
            continue;
        }
        uint32_t s = *level->at++, depth = level->depth;
        if (level->at == level->end) w->level_count--;
        if (!visit(w, s, depth)) return false;
    }
    if (w->opened_count == 0) return true;
    return err_set(w->err, ERR_SCENE, "the bracket '%s' isn't closed",
                   w->grammar->symbol[w->opened[w->opened_count - 1].bracket].name);
}

bool lsystem_walk(const Grammar *grammar, uint32_t depth, uint64_t seed, uint64_t limit, LsystemDraw draw, void *context,
                  Err *err)
{
    Walk w = {.grammar = grammar, .rng = rng_seed(seed, RNG_STREAM), .limit = limit, .end = affine_identity(),
              .draw = draw, .context = context, .err = err};
    bool ok = push_level(&w, &grammar->start, 1, depth) && walk(&w);
    free(w.level);
    free(w.opened);
    return ok;
}
