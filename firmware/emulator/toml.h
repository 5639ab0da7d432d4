// The part of TOML that a plant file needs: [tables] of key = number, key = "text", key = true or false.
// Comments and blank lines are allowed; nested tables, arrays and dates are not.

#ifndef TOML_H
#define TOML_H

// Called once per table (key = NULL) and once per value. Text is without its quotes, numbers and booleans as
// written. Returns NULL, or a sentence about what is wrong with it.
typedef const char *toml_visit(void *context, const char *table, const char *key, const char *value, int is_text);

// Returns 0, or -1 with "line 3: ..." in `error`.
int toml_parse(const char *text, toml_visit *visit, void *context, char *error, int error_size);

#endif
