/* The texts that options.c prints from its tables: help, manual page, shell completion. All go to standard
 * output. A command whose name has a space is a verb: a part of the text of its program. */
#ifndef LAMBERT_BASE_OPTION_TEXT_H
#define LAMBERT_BASE_OPTION_TEXT_H

#include "solver/base/options/options.h"

/* The row of --help, which every command has. */
extern const option_row option_help_row;

/* All rows of a list of tables. */
#define OPTIONS_EACH_ROW(tables, t, row)                                                                     \
    for (const option_table *t = (tables); t->rows != NULL; t++)                                             \
        for (const option_row *row = t->rows; row->name != NULL; row++)

/* True if the row explains its option and no row before it does so for the same name. */
bool option_is_first(const option_table *tables, const option_row *row);

/* The name of the value, "N" or the words of a choice; NULL of a flag. */
const char *option_argument(const option_row *row);

bool option_is_verb(const option_command *command);

/* --help, at most 80 columns wide. */
void option_text_help(const option_command *command, const option_table *tables);
void option_text_help_verbs(const option_command *program, const option_verb *verbs);

/* A manual page in roff; of a program with verbs its parts before and after the sections of the verbs. */
void option_text_manual(const option_command *command, const option_table *tables);
void option_text_manual_begin(const option_command *program, const option_verb *verbs);
void option_text_manual_end(const option_command *program);

/* The words of --print-completion. */
#define OPTION_SHELLS "bash|zsh|fish"

/* Completion of a command; of a program with verbs its parts before and after the commands of the verbs. */
void option_text_completion(const char *shell, const option_command *command, const option_table *tables);
void option_text_completion_begin(const char *shell, const option_command *program);
void option_text_completion_end(const char *shell, const option_command *program, const option_verb *verbs);

#endif
