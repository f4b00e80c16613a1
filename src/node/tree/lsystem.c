/* The string is never written out: a stack has, for each level of replacement, how far its body has been read, and the
 * symbols come out depth first, in order. One sequence of random numbers is drawn from in that order. */
#include "node/tree/lsystem.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "common/rng.h"

enum { FIRST_CAPACITY = 64, RNG_STREAM = 8, FEWEST_LEVELS = 4096 };

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

static bool too_long(Err *err, uint64_t limit)
{
    return err_set(err, ERR_LIMIT, "the L-system has more than the limit of %" PRIu64 " symbols", limit);
}

static bool visit(Walk *w, uint32_t s, uint32_t depth)
{
    if (++w->visited > w->limit) return too_long(w->err, w->limit);
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

static uint64_t capped_sum(uint64_t a, uint64_t b) { return a <= UINT64_MAX - b ? a + b : UINT64_MAX; }

static LsystemCount undivided(const Symbol *symbol)
{
    return (LsystemCount){1, symbol->meaning == SYMBOL_TRUNK || symbol->meaning == SYMBOL_LEAF};
}

/* What becomes of a symbol at least, if its replacements become what `of` says. */
static LsystemCount replaced(const Grammar *grammar, const Symbol *symbol, const LsystemCount *of)
{
    if (symbol->rule_count == 0) return undivided(symbol);
    LsystemCount least = {UINT64_MAX, UINT64_MAX};
    double sum = 0;
    for (uint32_t i = 0; i < symbol->rule_count; i++) {
        const Rule *rule = &grammar->rule[symbol->first_rule + i];
        if (rule->probability == 0) continue;
        sum += rule->probability;
        LsystemCount all = {0, 0};
        for (uint32_t k = 0; k < rule->count; k++) {
            const LsystemCount *one = &of[grammar->body[rule->first + k]];
            all = (LsystemCount){capped_sum(all.visited, one->visited), capped_sum(all.drawn, one->drawn)};
        }
        if (all.visited < least.visited) least.visited = all.visited;
        if (all.drawn < least.drawn) least.drawn = all.drawn;
    }
    if (sum < 1) least = (LsystemCount){0, 0};  /* it may disappear */
    least.visited = capped_sum(least.visited, 1);
    return least;
}

/* From depth 0 up. The fewest visited only grow with the depth, so what FEWEST_LEVELS have is true of more. */
bool lsystem_fewest(const Grammar *grammar, uint32_t depth, LsystemCount *fewest, Err *err)
{
    uint32_t n = grammar->symbol_count, levels = depth < FEWEST_LEVELS ? depth : FEWEST_LEVELS;
    LsystemCount *now = malloc(2 * (size_t)n * sizeof *now);
    if (!now) return err_memory(err, "an L-system");
    LsystemCount *next = now + n;
    for (uint32_t s = 0; s < n; s++) now[s] = undivided(&grammar->symbol[s]);
    for (uint32_t level = 0; level < levels; level++) {
        for (uint32_t s = 0; s < n; s++) next[s] = replaced(grammar, &grammar->symbol[s], now);
        memcpy(now, next, n * sizeof *now);
    }
    *fewest = now[grammar->start];
    if (levels < depth) fewest->drawn = 0;
    free(now);
    return true;
}

bool lsystem_walk(const Grammar *grammar, uint32_t depth, uint64_t seed, uint64_t limit, LsystemDraw draw, void *context,
                  Err *err)
{
    Walk w = {.grammar = grammar, .rng = rng_seed(seed, RNG_STREAM), .limit = limit, .end = affine_identity(),
              .draw = draw, .context = context, .err = err};
    LsystemCount fewest;
    if (!lsystem_fewest(grammar, depth, &fewest, err)) return false;
    if (fewest.visited > limit) return too_long(err, limit);
    bool ok = push_level(&w, &grammar->start, 1, depth) && walk(&w);
    free(w.level);
    free(w.opened);
    return ok;
}
