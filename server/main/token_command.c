/*
 * token_command.c - `srnfd token add|list|revoke`, on the data directory alone: whether a daemon
 * runs does not matter, and one that does takes notice with its next request (store/token.h).
 *
 *   srnfd token add --name NAME [--role viewer|user|admin|metrics|worker]
 *                   [--expires 90d|2027-01-31] [--secret-file FILE]
 *                   [--max-queued N] [--max-running N] [--max-bytes N] [--max-requests N]
 *                   [--max-streams N] [--data DIR]
 *   srnfd token list [--data DIR]
 *   srnfd token revoke ID|NAME [--data DIR]
 *
 * add prints the token, once, as the one line of standard output, and what it is on standard
 * error, so that TOKEN=$(srnfd token add ..) keeps the token alone. With --secret-file the token is
 * what that file holds, as a secret of an orchestrator, and nothing is printed on standard output.
 * list prints lines of fields separated by tabs, with a head; a field that does not apply is "-".
 */
#include "main/token_command.h"

#include "store/store.h"
#include "store/token.h"

#include <errno.h>
#include <inttypes.h>
#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define WRONG_USE 2
#define MS_PER_SECOND INT64_C(1000)

/* The options of all three, as given; NULL: not given. */
struct options {
    const char *data, *name, *role, *expires, *secret_file, *quotas[STORE_QUOTAS];
    const char *operand;
};

static const char usage[] =
    "usage: srnfd token add --name NAME [--role viewer|user|admin|metrics|worker]\n"
    "                       [--expires 90d|YYYY-MM-DD] [--secret-file FILE]\n"
    "                       [--max-queued N] [--max-running N] [--max-bytes N]\n"
    "                       [--max-requests N] [--max-streams N] [--data DIR]\n"
    "       srnfd token list [--data DIR]\n"
    "       srnfd token revoke ID|NAME [--data DIR]\n";

static int wrong_use(const char *what, const char *value)
{
    (void)fprintf(stderr, "srnfd token: %s%s%s\n%s", what, value ? ": " : "", value ? value : "",
                  usage);
    return WRONG_USE;
}

static int failed(const char *data, int status)
{
    (void)fprintf(stderr, "srnfd token: %s: %s\n", data,
                  status == STORE_CORRUPT ? "the file of tokens is damaged or not ours"
                                          : store_strerror(status));
    return 1;
}

/* ---- Arguments ------------------------------------------------------------------------------- */

/* Where the value of this option belongs; NULL: there is no such option. */
static const char **place_of(struct options *options, const char *option)
{
    const struct {
        const char *name;
        const char **place;
    } known[] = {{"--data", &options->data},
                 {"--name", &options->name},
                 {"--role", &options->role},
                 {"--expires", &options->expires},
                 {"--secret-file", &options->secret_file}};

    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcmp(known[i].name, option) == 0) {
            return known[i].place;
        }
    }
    for (int i = 0; i < STORE_QUOTAS; i++) {
        if (strncmp(option, "--max-", 6) == 0 &&
            strcmp(option + 6, store_quota_name((enum store_quota)i)) == 0) {
            return &options->quotas[i];
        }
    }
    return NULL;
}

/* Returns 0, or WRONG_USE having said why. */
static int read_options(struct options *options, int n_arguments, char **arguments)
{
    const char *data = getenv("SRNFD_DATA");

    *options = (struct options){.data = data && data[0] ? data : "data"};
    for (int i = 0; i < n_arguments; i++) {
        char option[32];
        const char *equals = strchr(arguments[i], '='), **place;

        if (arguments[i][0] != '-') {
            if (options->operand) {
                return wrong_use("one argument too many", arguments[i]);
            }
            options->operand = arguments[i];
            continue;
        }
        (void)snprintf(option, sizeof option, "%.*s",
                       equals ? (int)(equals - arguments[i]) : (int)sizeof option, arguments[i]);
        place = place_of(options, option);
        if (!place) {
            return wrong_use("no such option", arguments[i]);
        }
        if (!equals && i + 1 == n_arguments) {
            return wrong_use("an option without its value", arguments[i]);
        }
        *place = equals ? equals + 1 : arguments[++i];
    }
    return 0;
}

/* "90d", "12h" or "30m" from now, or a date, which begins in UTC, with a time or without. False:
   none of these, or not in the future. */
static bool read_expiry(const char *text, int64_t *expires_ms)
{
    static const char *const forms[] = {"%Y-%m-%d", "%Y-%m-%dT%H:%M:%SZ"};
    const int64_t now = store_now_ms();
    char *end;
    long count = strtol(text, &end, 10);
    int64_t unit = *end == 'd' ? 86400 : *end == 'h' ? 3600 : *end == 'm' ? 60 : 0;

    if (end != text && unit && !end[1] && count > 0 && count <= 1000000) {
        *expires_ms = now + count * unit * MS_PER_SECOND;
        return true;
    }
    for (size_t i = 0; i < sizeof forms / sizeof forms[0]; i++) {
        struct tm parts = {.tm_sec = 0};
        const char *rest = strptime(text, forms[i], &parts);

        if (rest && !*rest) {
            *expires_ms = (int64_t)timegm(&parts) * MS_PER_SECOND;
            return *expires_ms > now;
        }
    }
    return false;
}

static bool read_quota(const char *text, int64_t *quota)
{
    char *end;
    long long value;

    errno = 0;
    value = strtoll(text, &end, 10);
    *quota = value;
    return end != text && !*end && errno == 0 && value >= 0 && value <= STORE_QUOTA_LARGEST;
}

/* ---- The commands ---------------------------------------------------------------------------- */

/* The token that the options describe. Returns 0, or WRONG_USE having said why. */
static int read_token(const struct options *options, struct store_token *token)
{
    *token = (struct store_token){.role = STORE_ROLE_USER};
    if (options->operand) {
        return wrong_use("one argument too many", options->operand);
    }
    if (!options->name || !store_token_name_valid(options->name)) {
        return wrong_use("--name must be 1 to 64 letters, digits, dots, hyphens, underscores or @",
                         options->name);
    }
    memcpy(token->name, options->name, strlen(options->name));
    if (options->role && !store_role_from_name(options->role, &token->role)) {
        return wrong_use("--role must be viewer, user, admin, metrics or worker", options->role);
    }
    if (options->expires && !read_expiry(options->expires, &token->expires_ms)) {
        return wrong_use("--expires must be as in 90d, 12h, 2027-01-31 or 2027-01-31T12:00:00Z, "
                         "and in the future",
                         options->expires);
    }
    for (size_t i = 0; i < STORE_QUOTAS; i++) {
        token->quotas[i] = -1;
        if (options->quotas[i] && !read_quota(options->quotas[i], &token->quotas[i])) {
            return wrong_use("a quota must be a whole number, 0 for no limit", options->quotas[i]);
        }
    }
    return 0;
}

/* The first line of the file, where one is named. Returns 0, or WRONG_USE having said why. */
static int read_secret(const struct options *options, char secret[STORE_SECRET_MAX])
{
    FILE *file = options->secret_file ? fopen(options->secret_file, "re") : NULL;
    char line[STORE_SECRET_MAX + 2]; /* a longest one, its newline, and one character too many */

    if (!file || !fgets(line, sizeof line, file)) {
        line[0] = '\0';
    }
    if (file) {
        (void)fclose(file);
    }
    line[strcspn(line, "\r\n")] = '\0';
    secret[0] = '\0';
    if (strlen(line) < STORE_SECRET_MAX) {
        memcpy(secret, line, strlen(line) + 1);
    }
    sodium_memzero(line, sizeof line);
    if (options->secret_file && !store_secret_valid(secret)) {
        return wrong_use("--secret-file must hold 32 to 55 letters, digits, hyphens and "
                         "underscores",
                         options->secret_file);
    }
    return 0;
}

static int add(const struct options *options)
{
    char secret[STORE_SECRET_MAX];
    struct store_token token;
    int status = read_token(options, &token);

    if (status == 0) {
        status = read_secret(options, secret);
    }
    if (status != 0) {
        return status;
    }
    status = store_token_add(options->data, &token, secret);
    if (status != STORE_OK) {
        return failed(options->data, status);
    }
    if (options->secret_file) {
        (void)fprintf(stderr, "%s of %s, role %s, with the secret of %s\n", token.id, token.name,
                      store_role_name(token.role), options->secret_file);
        sodium_memzero(secret, sizeof secret);
        return 0;
    }
    (void)fprintf(stderr, "%s of %s, role %s; this is the only time that it is shown:\n", token.id,
                  token.name, store_role_name(token.role));
    (void)printf("%s\n", secret);
    sodium_memzero(secret, sizeof secret);
    return fflush(stdout) == 0 ? 0 : 1;
}

static void print_time(int64_t ms)
{
    time_t seconds = (time_t)(ms / MS_PER_SECOND);
    struct tm parts;
    char text[32];

    if (ms <= 0 || !gmtime_r(&seconds, &parts) ||
        strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts) == 0) {
        (void)printf("\t-");
        return;
    }
    (void)printf("\t%s", text);
}

static int list(const struct options *options)
{
    struct store_tokens tokens;
    int status;

    if (options->operand) {
        return wrong_use("one argument too many", options->operand);
    }
    status = store_tokens_load(options->data, &tokens);
    if (status != STORE_OK) {
        return failed(options->data, status);
    }
    store_tokens_uses(options->data, &tokens);
    (void)printf("id\tname\trole\tcreated\texpires\tlast-used");
    for (int k = 0; k < STORE_QUOTAS; k++) {
        (void)printf("\tmax-%s", store_quota_name((enum store_quota)k));
    }
    (void)printf("\n");
    for (size_t i = 0; i < tokens.n; i++) {
        const struct store_token *token = &tokens.list[i];

        (void)printf("%s\t%s\t%s", token->id, token->name, store_role_name(token->role));
        print_time(token->created_ms);
        print_time(token->expires_ms);
        print_time(token->last_ms);
        for (size_t k = 0; k < STORE_QUOTAS; k++) {
            (void)(token->quotas[k] < 0 ? printf("\t-") : printf("\t%" PRId64, token->quotas[k]));
        }
        (void)printf("\n");
    }
    store_tokens_clear(&tokens);
    return fflush(stdout) == 0 ? 0 : 1;
}

static int revoke(const struct options *options)
{
    size_t removed = 0;
    int status;

    if (!options->operand) {
        return wrong_use("which token: an id or a name", NULL);
    }
    status = store_token_revoke(options->data, options->operand, &removed);
    if (status != STORE_OK) {
        return failed(options->data, status);
    }
    if (removed == 0) {
        (void)fprintf(stderr, "srnfd token: there is no token \"%s\" in %s\n", options->operand,
                      options->data);
        return 1;
    }
    (void)fprintf(stderr, "%zu revoked\n", removed);
    return 0;
}

int token_command(int n_arguments, char **arguments)
{
    static const struct {
        const char *name;
        int (*run)(const struct options *options);
    } commands[] = {{"add", add}, {"list", list}, {"revoke", revoke}};
    struct options options;
    int status;

    for (size_t i = 0; n_arguments > 0 && i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(commands[i].name, arguments[0]) == 0) {
            status = read_options(&options, n_arguments - 1, arguments + 1);
            return status == 0 ? commands[i].run(&options) : status;
        }
    }
    return wrong_use(n_arguments > 0 ? "no such command" : "add, list or revoke",
                     n_arguments > 0 ? arguments[0] : NULL);
}
