/* Shell completion from the tables of options: a function (bash, zsh) or lines (fish) for each command. */
#include "solver/base/options/option_text.h"

#include <stdio.h>
#include <string.h>

/* "lambert_solve" of "lambert solve". */
static void function_name(const option_command *command, char out[64]) {
    snprintf(out, 64, "%s", command->name);
    for (char *c = out; *c != '\0'; c++)
        if (*c == ' ') *c = '_';
}

/* The words of "a|b" with spaces between them. */
static void print_words(const char *choices) {
    for (const char *c = choices; *c != '\0'; c++) putchar(*c == '|' ? ' ' : *c);
}

/* The first sentence, in single quotes where `escaped` characters get a backslash. bash and zsh leave the
 * quotes for a quote in the text, fish does not. */
static void print_description(const char *text, const char *escaped) {
    const char *end = strstr(text, ". ");
    for (const char *c = text; *c != '\0' && c != end; c++) {
        if (strchr(escaped, *c) != NULL) putchar('\\');
        if (*c == '\'' && strchr(escaped, '\'') == NULL)
            fputs("'\\''", stdout);
        else
            putchar(*c);
    }
}

static bool takes_file(const option_row *row) {
    return row->kind == OPTION_TEXT;
}

static bool takes_word(const option_row *row) {
    return row->kind == OPTION_CHOICE || row->kind == OPTION_WORD;
}

/* A value of the next word: that of an optional one is in the same word. */
static bool takes_next(const option_row *row) {
    return row->kind != OPTION_FLAG && !option_may_stand_alone(row);
}

static void bash_command(const option_command *command, const option_table *tables) {
    char function[64];
    function_name(command, function);
    printf("_%s() # the word before, the word\n{\n    case $1 in\n", function);
    OPTIONS_EACH_ROW(tables, t, row) {
        if (!takes_next(row) || !option_is_first(tables, row)) continue;
        printf("    ");
        if (row->letter != 0) printf("-%c|", row->letter);
        printf("--%s) ", row->name);
        if (takes_word(row)) {
            fputs("COMPREPLY=($(compgen -W \"", stdout);
            print_words(row->choices);
            fputs("\" -- \"$2\")) ", stdout);
        }
        puts(";;");
    }
    fputs("    *)\n        case $2 in\n        -*) COMPREPLY=($(compgen -W \"", stdout);
    OPTIONS_EACH_ROW(tables, t, row)
    if (option_is_first(tables, row)) printf("--%s ", row->name);
    puts("--help\" -- \"$2\")) ;;");
    if (command->choices != NULL) {
        fputs("        *) COMPREPLY=($(compgen -W \"", stdout);
        print_words(command->choices);
        puts("\" -- \"$2\")) ;;");
    }
    puts("        esac ;;\n    esac\n}");
}

/* bash takes "=" for a word: --sun=exact is three. */
static const char bash_split[] =
    "    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
    "    [ \"$word\" = = ] && word=\n"
    "    [ \"$before\" = = ] && before=${COMP_WORDS[COMP_CWORD-2]}\n"
    "    COMPREPLY=()\n";

static void bash_program(const option_command *program) {
    printf("_%s_program()\n{\n%s    _%s \"$before\" \"$word\"\n}\ncomplete -o default -F _%s_program %s\n",
           program->name, bash_split, program->name, program->name, program->name);
}

static void bash_verbs(const option_command *program, const option_verb *verbs) {
    const char *name = program->name;
    printf("_%s()\n{\n%s    local verbs=\"", name, bash_split);
    for (const option_verb *v = verbs; v->name != NULL; v++) printf("%s ", v->name);
    printf("help\"\n"
           "    if [ \"$COMP_CWORD\" = 1 ]; then\n"
           "        COMPREPLY=($(compgen -W \"$verbs --help --version\" -- \"$word\"))\n"
           "    elif [ \"${COMP_WORDS[1]}\" = help ]; then\n"
           "        COMPREPLY=($(compgen -W \"$verbs\" -- \"$word\"))\n"
           "    elif declare -F \"_%s_${COMP_WORDS[1]}\" > /dev/null; then\n"
           "        \"_%s_${COMP_WORDS[1]}\" \"$before\" \"$word\"\n"
           "    fi\n}\ncomplete -o default -F _%s %s\n",
           name, name, name, name);
}

static void zsh_row(const option_row *row) {
    static const char escaped[] = "[]\\";
    if (row->kind == OPTION_LIST) putchar('*'); /* may be given again */
    const char *equals = takes_next(row) ? "=" : option_may_stand_alone(row) ? "=-" : "";
    if (row->letter != 0)
        printf("'(-%c --%s)'{-%c%s,--%s%s}'[", row->letter, row->name, row->letter,
               takes_next(row) ? "+" : "", row->name, equals);
    else
        printf("--%s%s[", row->name, equals);
    print_description(row->help, escaped);
    putchar(']');
    if (row->kind == OPTION_FLAG) return;
    fputs(option_may_stand_alone(row) ? "::value:" : ":value:", stdout);
    if (row->choices != NULL) {
        putchar('(');
        print_words(row->choices);
        putchar(')');
    } else {
        fputs(takes_file(row) ? "_files" : " ", stdout);
    }
}

static void zsh_command(const option_command *command, const option_table *tables) {
    char function[64];
    function_name(command, function);
    printf("_%s()\n{\n    _arguments \\\n", function);
    OPTIONS_EACH_ROW(tables, t, row) {
        if (!option_is_first(tables, row)) continue;
        /* A row with a letter opens its quotes after the braces. */
        fputs(row->letter != 0 ? "        " : "        '", stdout);
        zsh_row(row);
        puts("' \\");
    }
    printf("        '(-h --help)'{-h,--help}'[Print this and stop]' \\\n        '1:argument:");
    if (command->choices != NULL) {
        putchar('(');
        print_words(command->choices);
        putchar(')');
    } else {
        fputs("_files", stdout);
    }
    puts("' '*:file:_files'\n}");
}

static void zsh_verbs(const option_command *program, const option_verb *verbs) {
    printf("_%s()\n{\n    local -a verbs=(\n", program->name);
    for (const option_verb *v = verbs; v->name != NULL; v++) {
        printf("        '%s:", v->name);
        print_description(v->summary, "\\");
        puts("'");
    }
    printf("        'help:explain a verb'\n    )\n"
           "    if (( CURRENT == 2 )) || [[ $words[2] == help ]]; then\n"
           "        _describe verb verbs\n"
           "    elif (( $+functions[_%s_$words[2]] )); then\n"
           "        shift words\n"
           "        (( CURRENT-- ))\n"
           "        _%s_$words[1]\n"
           "    else\n        _files\n    fi\n}\n_%s \"$@\"\n",
           program->name, program->name, program->name);
}

/* The lines of a verb hold once the verb is on the command line. */
static void fish_command(const option_command *command, const option_table *tables) {
    static const char escaped[] = "'\\";
    const char *verb = strchr(command->name, ' ');
    char condition[128] = "";
    const int length = verb != NULL ? (int)(verb - command->name) : (int)strlen(command->name);
    if (verb != NULL) snprintf(condition, sizeof condition, " -n '__fish_seen_subcommand_from%s'", verb);
    OPTIONS_EACH_ROW(tables, t, row) {
        if (!option_is_first(tables, row)) continue;
        printf("complete -c %.*s%s -l %s", length, command->name, condition, row->name);
        if (row->letter != 0) printf(" -s %c", row->letter);
        if (takes_next(row)) fputs(takes_file(row) ? " -r -F" : " -x", stdout);
        if (takes_word(row)) {
            fputs(" -a '", stdout);
            print_words(row->choices);
            putchar('\'');
        }
        fputs(" -d '", stdout);
        print_description(row->help, escaped);
        puts("'");
    }
    printf("complete -c %.*s%s -s h -l help -d '%s'\n", length, command->name, condition,
           option_help_row.help);
    if (command->choices == NULL) return;
    printf("complete -c %.*s%s -f -a '", length, command->name, condition);
    print_words(command->choices);
    puts("'");
}

static void fish_verbs(const option_command *program, const option_verb *verbs) {
    for (const option_verb *v = verbs; v->name != NULL; v++) {
        printf("complete -c %s -n '__fish_use_subcommand; or __fish_seen_subcommand_from help' -f -a %s -d '",
               program->name, v->name);
        print_description(v->summary, "'\\");
        puts("'");
    }
    printf("complete -c %s -n __fish_use_subcommand -f -a help -d 'explain a verb'\n", program->name);
}

void option_text_completion_begin(const char *shell, const option_command *program) {
    if (strcmp(shell, "zsh") == 0) printf("#compdef %s\n", program->name);
}

void option_text_completion(const char *shell, const option_command *command, const option_table *tables) {
    const bool program = !option_is_verb(command);
    if (strcmp(shell, "fish") == 0) {
        fish_command(command, tables);
    } else if (strcmp(shell, "zsh") == 0) {
        if (program) option_text_completion_begin(shell, command);
        zsh_command(command, tables);
        if (program) printf("_%s \"$@\"\n", command->name);
    } else {
        bash_command(command, tables);
        if (program) bash_program(command);
    }
}

void option_text_completion_end(const char *shell, const option_command *program, const option_verb *verbs) {
    if (strcmp(shell, "fish") == 0)
        fish_verbs(program, verbs);
    else if (strcmp(shell, "zsh") == 0)
        zsh_verbs(program, verbs);
    else
        bash_verbs(program, verbs);
}
