// The part of TOML that a plant file needs.

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "toml.h"

#define WORD_MAX 128

// Copy up to one of `stops`, without trailing blanks. Returns where it stopped, or NULL if it is too long.
static const char *
word(const char *from, const char *stops, char *to)
{
    size_t length = strcspn(from, stops);
    const char *end = from + length;
    while (length && isspace((unsigned char)from[length - 1]))
        --length;
    if (length >= WORD_MAX)
        return NULL;
    memcpy(to, from, length);
    to[length] = 0;
    return end;
}

static const char *
blanks(const char *from)
{
    return from + strspn(from, " \t\r");
}

// One line, which may be blank. Returns NULL or what is wrong.
static const char *
parse_line(const char *line, char *table, toml_visit *visit, void *context)
{
    char key[WORD_MAX], value[WORD_MAX];
    const char *at = blanks(line);
    const char *wrong;
    if (*at == '[') {
        at = word(blanks(at + 1), "]\n#", table);
        if (!at || *at != ']' || !*table)
            return "a table is written [name]";
        ++at;
        wrong = visit(context, table, NULL, NULL, 0);
    } else if (*at && *at != '\n' && *at != '#') {
        at = word(at, "=\n#", key);
        if (!at || *at != '=' || !*key)
            return "expected key = value";
        at = blanks(at + 1);
        int is_text = *at == '"';
        at = is_text ? word(at + 1, "\"\n", value) : word(at, "#\n", value);
        if (!at || (is_text && *at != '"') || (!is_text && !*value))
            return "the value is missing or not closed";
        at += is_text;
        wrong = visit(context, table, key, value, is_text);
    } else {
        return NULL;
    }
    if (wrong)
        return wrong;
    at = blanks(at);
    return *at && *at != '\n' && *at != '#' ? "something follows that does not belong there" : NULL;
}

// What a stranger wrote may reach a terminal: only what prints is passed on.
static void
make_printable(char *text)
{
    for (; *text; ++text)
        if (*text < ' ' || *text > '~')
            *text = '?';
}

int
toml_parse(const char *text, toml_visit *visit, void *context, char *error, int error_size)
{
    char table[WORD_MAX] = "";
    for (int number = 1; *text; ++number) {
        const char *wrong = parse_line(text, table, visit, context);
        if (wrong) {
            snprintf(error, error_size, "line %d: %s", number, wrong);
            make_printable(error);
            return -1;
        }
        text += strcspn(text, "\n");
        text += *text == '\n';
    }
    return 0;
}
