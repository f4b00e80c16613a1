/* Symbols are numbered as they are met. What a line says is stored at once with its line's number; what can be judged
 * only with the whole file (a symbol without meaning or rule, a rule of a bracket) is judged at the end. */
#include "node/tree/grammar.h"

#include <inttypes.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>

#include "common/arena.h"
#include "common/numeric.h"
#include "tools/lines.h"

enum { FIRST_CAPACITY = 16, SHOWN_CHARS = 40, DRAWN_TOKENS = 5, BRANCH_TOKENS = 6 };

#define NO_SYMBOL UINT32_MAX
#define MAX_COUNT (UINT32_MAX - 1)

typedef struct { const char *text; size_t length; } Token;

/* What is known of a symbol while reading. */
typedef struct {
    uint64_t hash;
    uint64_t used_line;     /* first use as start or in a body, 0: none */
    uint64_t meaning_line;  /* 0: no meaning yet */
    uint64_t rule_line;     /* of the first rule, 0: none */
    double probability;     /* of all rules so far */
} SymbolNote;

typedef struct {
    uint32_t symbol;  /* whose rule it is */
    uint64_t line;
} RuleNote;

typedef struct {
    Grammar *grammar;
    Arena *names;
    Lines lines;
    Err *err;
    locale_t c_locale;
    SymbolNote *note;        /* as long as grammar->symbol */
    RuleNote *rule_note;     /* as long as grammar->rule */
    uint32_t *slot;          /* hash table of symbols, never more than half full */
    Token *token;            /* of the line */
    uint32_t *open;          /* brackets of a body that are still open */
    uint32_t symbol_capacity, note_capacity, rule_capacity, rule_note_capacity, body_capacity, body_count;
    uint32_t slot_capacity, token_capacity, token_count, open_capacity;
} Reader;

/* Room for one more element behind `count`; the possibly moved array, or NULL without memory (the old one stays). */
static void *make_room(Reader *r, void *array, uint32_t count, uint32_t *capacity, size_t element)
{
    if (count < *capacity) return array;
    uint32_t more = *capacity ? *capacity > MAX_COUNT / 2 ? MAX_COUNT : 2 * *capacity : FIRST_CAPACITY;
    void *larger = more > count ? realloc(array, more * element) : NULL;
    if (larger)
        *capacity = more;
    else
        err_memory(r->err, r->lines.path);
    return larger;
}

/* ---- tokens ---- */

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

static bool split(Reader *r, const char *p, const char *end)
{
    r->token_count = 0;
    while (p < end) {
        while (p < end && is_blank(*p)) p++;
        const char *from = p;
        while (p < end && !is_blank(*p)) p++;
        if (p == from) break;
        Token *token = make_room(r, r->token, r->token_count, &r->token_capacity, sizeof *token);
        if (!token) return false;
        r->token = token;
        token[r->token_count++] = (Token){from, (size_t)(p - from)};
    }
    return true;
}

static bool token_is(Token token, const char *text)
{
    return token.length == strlen(text) && memcmp(token.text, text, token.length) == 0;
}

/* "'TOKEN' WHAT", the token cut to a readable length. */
static bool token_error(Reader *r, Token token, const char *what)
{
    bool cut = token.length > SHOWN_CHARS;
    return lines_error(&r->lines, r->err, "'%.*s%s' %s", (int)(cut ? SHOWN_CHARS : token.length), token.text,
                       cut ? "..." : "", what);
}

/* A finite decimal number; strtod_l alone would take hexadecimal ones and the names of the infinities too. */
static bool parse_number(Reader *r, Token token, double *x)
{
    if (strspn(token.text, "+-.0123456789eE") >= token.length) {
        char *end;
        *x = strtod_l(token.text, &end, r->c_locale);
        if (end == token.text + token.length && isfinite(*x)) return true;
    }
    return token_error(r, token, "is not a finite number");
}

/* ---- symbols ---- */

static uint64_t hash_token(Token token)
{
    uint64_t h = 0xcbf29ce484222325u;  /* FNV-1a */
    for (size_t i = 0; i < token.length; i++) h = (h ^ (unsigned char)token.text[i]) * 0x100000001b3u;
    return h ^ h >> 32;
}

static bool grow_slots(Reader *r)
{
    uint32_t capacity = r->slot_capacity ? 2 * r->slot_capacity : 2 * FIRST_CAPACITY;
    uint32_t *slot = malloc(capacity * sizeof *slot);
    if (!slot) return err_memory(r->err, r->lines.path);
    memset(slot, 0xff, capacity * sizeof *slot);  /* NO_SYMBOL */
    for (uint32_t s = 0; s < r->grammar->symbol_count; s++) {
        uint32_t at = (uint32_t)r->note[s].hash & (capacity - 1);
        while (slot[at] != NO_SYMBOL) at = (at + 1) & (capacity - 1);
        slot[at] = s;
    }
    free(r->slot);
    r->slot = slot;
    r->slot_capacity = capacity;
    return true;
}

static bool add_symbol(Reader *r, Token token, uint64_t hash)
{
    Grammar *g = r->grammar;
    Symbol *symbol = make_room(r, g->symbol, g->symbol_count, &r->symbol_capacity, sizeof *symbol);
    if (!symbol) return false;
    g->symbol = symbol;
    SymbolNote *note = make_room(r, r->note, g->symbol_count, &r->note_capacity, sizeof *note);
    if (!note) return false;
    r->note = note;
    char *name = arena_alloc(r->names, token.length + 1);
    if (!name) return err_memory(r->err, r->lines.path);
    memcpy(name, token.text, token.length);
    name[token.length] = '\0';
    symbol[g->symbol_count] = (Symbol){.name = name, .meaning = SYMBOL_NOTHING};
    note[g->symbol_count++] = (SymbolNote){.hash = hash};
    return true;
}

/* The number of a symbol, a new one if it hasn't been met. */
static bool find_symbol(Reader *r, Token token, uint32_t *symbol)
{
    if (2 * (r->grammar->symbol_count + 1) > r->slot_capacity && !grow_slots(r)) return false;
    uint64_t hash = hash_token(token);
    uint32_t mask = r->slot_capacity - 1, at = (uint32_t)hash & mask;
    for (; r->slot[at] != NO_SYMBOL; at = (at + 1) & mask) {
        *symbol = r->slot[at];
        if (r->note[*symbol].hash == hash && token_is(token, r->grammar->symbol[*symbol].name)) return true;
    }
    if (!add_symbol(r, token, hash)) return false;
    *symbol = r->slot[at] = r->grammar->symbol_count - 1;
    return true;
}

static bool use_symbol(Reader *r, Token token, uint32_t *symbol)
{
    if (!find_symbol(r, token, symbol)) return false;
    if (r->note[*symbol].used_line == 0) r->note[*symbol].used_line = r->lines.number;
    return true;
}

static bool give_meaning(Reader *r, uint32_t symbol, SymbolMeaning meaning)
{
    SymbolNote *note = &r->note[symbol];
    Symbol *s = &r->grammar->symbol[symbol];
    if (note->meaning_line)
        return lines_error(&r->lines, r->err, "'%.*s' has two meanings; the first is on line %" PRIu64, SHOWN_CHARS,
                           s->name, note->meaning_line);
    note->meaning_line = r->lines.number;
    s->meaning = meaning;
    return true;
}

/* ---- lines ---- */

static bool read_start(Reader *r)
{
    if (r->token_count != 1)
        return lines_error(&r->lines, r->err, "the first line must be the start symbol alone");
    return use_symbol(r, r->token[0], &r->grammar->start);
}

static bool read_drawn(Reader *r, SymbolMeaning meaning)
{
    uint32_t symbol;
    double size[3];
    if (r->token_count != DRAWN_TOKENS)
        return lines_error(&r->lines, r->err, "%s needs a symbol and three sizes",
                           meaning == SYMBOL_TRUNK ? "trunk" : "leaf");
    for (int i = 0; i < 3; i++) {
        if (!parse_number(r, r->token[2 + i], &size[i])) return false;
        if (size[i] == 0) return token_error(r, r->token[2 + i], "is no size");
    }
    if (!find_symbol(r, r->token[1], &symbol) || !give_meaning(r, symbol, meaning)) return false;
    memcpy(r->grammar->symbol[symbol].size, size, sizeof size);
    return true;
}

static Affine rotation(const double deg[3])
{
    Affine x = affine_rotate(0, deg[0]), y = affine_rotate(1, deg[1]), z = affine_rotate(2, deg[2]);
    Affine yx = affine_mul(&y, &x);
    return affine_mul(&z, &yx);
}

static bool read_branch(Reader *r)
{
    uint32_t open, shut;
    double deg[3];
    if (r->token_count != BRANCH_TOKENS)
        return lines_error(&r->lines, r->err, "branch needs two brackets and three angles");
    for (int i = 0; i < 3; i++)
        if (!parse_number(r, r->token[3 + i], &deg[i])) return false;
    if (!find_symbol(r, r->token[1], &open) || !find_symbol(r, r->token[2], &shut)) return false;
    if (open == shut) return token_error(r, r->token[1], "can't be both brackets of a pair");
    if (!give_meaning(r, open, SYMBOL_OPEN) || !give_meaning(r, shut, SYMBOL_CLOSE)) return false;
    Symbol *symbol = r->grammar->symbol;
    symbol[open].pair = shut;
    symbol[shut].pair = open;
    symbol[open].turn = rotation(deg);
    return true;
}

static bool add_rule(Reader *r, uint32_t symbol, double probability)
{
    Grammar *g = r->grammar;
    Rule *rule = make_room(r, g->rule, g->rule_count, &r->rule_capacity, sizeof *rule);
    if (!rule) return false;
    g->rule = rule;
    RuleNote *note = make_room(r, r->rule_note, g->rule_count, &r->rule_note_capacity, sizeof *note);
    if (!note) return false;
    r->rule_note = note;
    note[g->rule_count] = (RuleNote){symbol, r->lines.number};
    rule[g->rule_count++] = (Rule){probability, r->body_count, r->token_count - 2};
    g->symbol[symbol].rule_count++;
    if (r->note[symbol].rule_line == 0) r->note[symbol].rule_line = r->lines.number;
    return true;
}

static bool read_rule(Reader *r)
{
    Grammar *g = r->grammar;
    uint32_t symbol;
    double probability = 0;
    if (r->token_count < 2) return token_error(r, r->token[0], "needs a probability and symbols");
    if (!parse_number(r, r->token[1], &probability)) return false;
    if (!(probability >= 0)) return token_error(r, r->token[1], "is no probability");
    if (!find_symbol(r, r->token[0], &symbol)) return false;
    /* 0.1 ten times may add up to a little more than 1: a rounding for each number read and each sum */
    double sum = r->note[symbol].probability += probability;
    if (sum > 1 + GAMMA(2 * (g->symbol[symbol].rule_count + 1.0)))
        return lines_error(&r->lines, r->err, "the probabilities of '%.*s' add up to %.6g, which is more than 1",
                           SHOWN_CHARS, g->symbol[symbol].name, sum);
    if (!add_rule(r, symbol, probability)) return false;
    for (uint32_t i = 2; i < r->token_count; i++) {
        uint32_t *body = make_room(r, g->body, r->body_count, &r->body_capacity, sizeof *body);
        if (!body) return false;
        g->body = body;
        if (!use_symbol(r, r->token[i], &body[r->body_count])) return false;
        r->body_count++;
    }
    return true;
}

static bool read_line(Reader *r, bool first)
{
    if (first) return read_start(r);
    if (token_is(r->token[0], "trunk")) return read_drawn(r, SYMBOL_TRUNK);
    if (token_is(r->token[0], "leaf")) return read_drawn(r, SYMBOL_LEAF);
    if (token_is(r->token[0], "branch")) return read_branch(r);
    return read_rule(r);
}

/* ---- judging the whole ---- */

static bool error_at(Reader *r, uint64_t line, const char *what, uint32_t symbol)
{
    return err_set(r->err, ERR_INPUT, "%s:%" PRIu64 ": '%.*s' %s", r->lines.path, line, SHOWN_CHARS,
                   r->grammar->symbol[symbol].name, what);
}

static bool check_symbols(Reader *r)
{
    const Grammar *g = r->grammar;
    for (uint32_t s = 0; s < g->symbol_count; s++) {
        const SymbolNote *note = &r->note[s];
        bool bracket = g->symbol[s].meaning == SYMBOL_OPEN || g->symbol[s].meaning == SYMBOL_CLOSE;
        if (bracket && note->rule_line) return error_at(r, note->rule_line, "is a bracket and can't have a rule", s);
        if (bracket && s == g->start) return error_at(r, note->used_line, "is a bracket and can't be the start", s);
        if (note->used_line && !note->meaning_line && !note->rule_line)
            return error_at(r, note->used_line, "has neither a meaning nor a rule", s);
    }
    return true;
}

/* Brackets must pair within each body; then they do in every string that can come of it. */
static bool check_brackets(Reader *r, const Rule *rule, uint64_t line)
{
    const Grammar *g = r->grammar;
    uint32_t depth = 0;
    for (uint32_t i = rule->first; i < rule->first + rule->count; i++) {
        uint32_t s = g->body[i];
        if (g->symbol[s].meaning == SYMBOL_OPEN) {
            uint32_t *open = make_room(r, r->open, depth, &r->open_capacity, sizeof *open);
            if (!open) return false;
            r->open = open;
            open[depth++] = s;
        } else if (g->symbol[s].meaning == SYMBOL_CLOSE) {
            if (depth == 0) return error_at(r, line, "closes a bracket that isn't open", s);
            if (g->symbol[s].pair != r->open[--depth])
                return error_at(r, line, "is not closed by its own bracket", r->open[depth]);
        }
    }
    return depth == 0 || error_at(r, line, "is not closed", r->open[depth - 1]);
}

/* Brings the rules of one symbol together, in the order of the file (a counting sort). */
static bool sort_rules(Reader *r)
{
    Grammar *g = r->grammar;
    if (g->rule_count == 0) return true;
    Rule *sorted = malloc(g->rule_count * sizeof *sorted);
    if (!sorted) return err_memory(r->err, r->lines.path);
    uint32_t first = 0;
    for (uint32_t s = 0; s < g->symbol_count; s++) {
        g->symbol[s].first_rule = first;
        first += g->symbol[s].rule_count;
        g->symbol[s].rule_count = 0;
    }
    for (uint32_t i = 0; i < g->rule_count; i++) {
        Symbol *s = &g->symbol[r->rule_note[i].symbol];
        sorted[s->first_rule + s->rule_count++] = g->rule[i];
    }
    free(g->rule);
    g->rule = sorted;
    return true;
}

static bool read_all(Reader *r)
{
    bool first = true;
    for (;;) {
        const char *text, *end;
        LinesResult result = lines_next(&r->lines, &text, &end, r->err);
        if (result == LINES_FAILED) return false;
        if (result == LINES_END) break;
        if (!split(r, text, end)) return false;
        if (r->token_count == 0) continue;
        if (!read_line(r, first)) return false;
        first = false;
    }
    if (first) return err_set(r->err, ERR_INPUT, "%s:1: no start symbol", r->lines.path);
    if (!check_symbols(r)) return false;
    for (uint32_t i = 0; i < r->grammar->rule_count; i++)
        if (!check_brackets(r, &r->grammar->rule[i], r->rule_note[i].line)) return false;
    return sort_rules(r);
}

static void free_reader(Reader *r)
{
    if (r->c_locale) freelocale(r->c_locale);
    free(r->note);
    free(r->rule_note);
    free(r->slot);
    free(r->token);
    free(r->open);
    lines_close(&r->lines);
}

Grammar *grammar_load(const char *path, Err *err)
{
    Reader r = {.err = err};
    if (!lines_open(&r.lines, path, false, err)) return NULL;
    r.c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    Grammar *grammar = r.grammar = calloc(1, sizeof *grammar);
    if (grammar) grammar->memory = r.names = arena_create();
    bool ok = grammar && r.names && r.c_locale;
    if (!ok) err_memory(err, path);
    ok = ok && read_all(&r);
    free_reader(&r);
    if (ok) return grammar;
    grammar_destroy(grammar);
    return NULL;
}

void grammar_destroy(Grammar *grammar)
{
    if (!grammar) return;
    free(grammar->symbol);
    free(grammar->rule);
    free(grammar->body);
    arena_destroy(grammar->memory);
    free(grammar);
}

bool grammar_source_load(GrammarSource *source, Err *err)
{
    if (!source->loaded) source->loaded = grammar_load(source->path, err);
    return source->loaded != NULL;
}
