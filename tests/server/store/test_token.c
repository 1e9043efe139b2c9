/*
 * The file of tokens: what is added is found by its secret, which the file does not hold; what is
 * revoked is not; writers that come at once lose nothing; a file that is not exactly ours is
 * refused as a whole.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <pthread.h>
#include <stdatomic.h>

#include "fixture.h"
#include "store/holdings.h"
#include "store/store.h"
#include "store/token.h"
#include "support/timing.h"

#define THREADS 8
#define EACH 10

static int add(const char *path, const char *name, enum store_role role, char *secret, char *id)
{
    struct store_token token = {.role = role, .quotas = {-1, 0, 5, -1, 7}};
    int status;

    snprintf(token.name, sizeof token.name, "%s", name);
    secret[0] = '\0'; /* a new one */
    status = store_token_add(path, &token, secret);
    if (id) {
        memcpy(id, token.id, STORE_TOKEN_ID_MAX);
    }
    return status;
}

static size_t count_tokens(const char *path)
{
    struct store_tokens tokens;
    size_t n;

    assert_int_equal(store_tokens_load(path, &tokens), STORE_OK);
    n = tokens.n;
    store_tokens_clear(&tokens);
    return n;
}

static char *read_file(const char *path, size_t *size)
{
    char name[512], *text = calloc(1, 100000);
    FILE *file;

    snprintf(name, sizeof name, "%s/tokens", path);
    file = fopen(name, "r");
    assert_non_null(file);
    *size = fread(text, 1, 99999, file);
    fclose(file);
    return text;
}

static void write_file(const char *path, const char *text, size_t size)
{
    char name[512];
    FILE *file;

    snprintf(name, sizeof name, "%s/tokens", path);
    file = fopen(name, "w");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, size, file), size);
    fclose(file);
}

static void a_token_is_found_by_its_secret_alone(void **state)
{
    struct fixture *fixture = *state;
    char secret[STORE_SECRET_MAX], other[STORE_SECRET_MAX], id[STORE_TOKEN_ID_MAX], *text;
    struct store_tokens tokens;
    const struct store_token *token;
    size_t size;

    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_VIEWER, secret, id), STORE_OK);
    assert_int_equal(add(fixture->path, "ben", STORE_ROLE_ADMIN, other, NULL), STORE_OK);
    assert_int_equal(strlen(secret), 49);
    assert_memory_equal(secret, "srnfd_", 6);
    assert_string_not_equal(secret, other);
    assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_OK);
    token = store_tokens_find(&tokens, secret);
    assert_non_null(token);
    assert_string_equal(token->name, "ada");
    assert_string_equal(token->id, id);
    assert_int_equal(token->role, STORE_ROLE_VIEWER);
    assert_true(llabs(token->created_ms - store_now_ms()) < 60000);
    assert_int_equal(token->quotas[STORE_QUOTA_QUEUED], -1);
    assert_int_equal(token->quotas[STORE_QUOTA_STREAMS], 7);
    assert_int_equal(store_tokens_find(&tokens, other)->role, STORE_ROLE_ADMIN);
    secret[20] ^= 1;
    assert_null(store_tokens_find(&tokens, secret));
    assert_null(store_tokens_find(&tokens, ""));
    assert_null(store_tokens_find(&tokens, token->hash));
    secret[20] ^= 1;
    store_tokens_clear(&tokens);

    text = read_file(fixture->path, &size);
    assert_null(strstr(text, secret));
    assert_null(strstr(text, secret + 6));
    free(text);
}

static void the_file_is_its_owners_alone(void **state)
{
    struct fixture *fixture = *state;
    char secret[STORE_SECRET_MAX], path[300], name[320];
    struct stat info;

    snprintf(path, sizeof path, "%s/a/b", fixture->path); /* a directory that is not there yet */
    assert_int_equal(add(path, "ada", STORE_ROLE_USER, secret, NULL), STORE_OK);
    snprintf(name, sizeof name, "%s/tokens", path);
    assert_int_equal(stat(name, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0600);
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0777, 0700);
}

/* Each request looks its token up: thousands of them must not cost what a request costs. */
static void thousands_are_looked_up_at_once(void **state)
{
    enum { COUNT = 5000 };
    struct fixture *fixture = *state;
    char *text = test_malloc(COUNT * 200), secret[32], hash[65];
    struct store_tokens tokens;
    size_t used;
    double start;

    used = (size_t)snprintf(text, 200, "srnfd-tokens 1\n");
    for (int i = 0; i < COUNT; i++) {
        snprintf(secret, sizeof secret, "secret-%d", i);
        store_sha256_hex(hash, secret, strlen(secret));
        used += (size_t)snprintf(text + used, 200,
                                 "tok-%016x\tuser%d\tuser\t%s\t1\t0\t-1\t-1"
                                 "\t-1\t-1\t-1\n",
                                 (unsigned)i, i, hash);
    }
    write_file(fixture->path, text, used);
    test_free(text);
    assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_OK);
    assert_int_equal(tokens.n, COUNT);
    start = timing_cpu();
    for (int i = 0; i < COUNT; i++) {
        const struct store_token *token;

        snprintf(secret, sizeof secret, "secret-%d", i);
        token = store_tokens_find(&tokens, secret);
        assert_true(token == &tokens.list[i]);
    }
    print_message("# %.1f us to look one of %d tokens up\n", 1e6 * (timing_cpu() - start) / COUNT,
                  COUNT);
    assert_true((timing_cpu() - start) / COUNT < 100e-6);
    assert_null(store_tokens_find(&tokens, "secret-5000"));
    store_tokens_clear(&tokens);
}

static void a_revoked_token_is_gone(void **state)
{
    struct fixture *fixture = *state;
    char a[STORE_SECRET_MAX], b[STORE_SECRET_MAX], id[STORE_TOKEN_ID_MAX];
    struct store_token_stamp before, after;
    struct store_tokens tokens;
    size_t removed;

    assert_int_equal(store_token_look(fixture->path, &before), STORE_OK);
    assert_false(before.exists);
    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_USER, a, id), STORE_OK);
    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_USER, b, NULL), STORE_OK);
    assert_int_equal(store_token_look(fixture->path, &before), STORE_OK);
    assert_int_equal(store_token_revoke(fixture->path, "nobody", &removed), STORE_OK);
    assert_int_equal(removed, 0);
    assert_int_equal(store_token_look(fixture->path, &after), STORE_OK);
    assert_true(store_token_same(&before, &after));
    assert_int_equal(store_token_revoke(fixture->path, id, &removed), STORE_OK);
    assert_int_equal(removed, 1);
    assert_int_equal(store_token_look(fixture->path, &after), STORE_OK);
    assert_false(store_token_same(&before, &after));
    assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_OK);
    assert_true(store_token_same(&after, &tokens.stamp));
    assert_null(store_tokens_find(&tokens, a));
    assert_non_null(store_tokens_find(&tokens, b));
    store_tokens_clear(&tokens);
    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_USER, a, NULL), STORE_OK);
    assert_int_equal(store_token_revoke(fixture->path, "ada", &removed), STORE_OK);
    assert_int_equal(removed, 2);
    /* The file stays, so that a daemon goes on asking for tokens. */
    assert_int_equal(store_token_look(fixture->path, &after), STORE_OK);
    assert_true(after.exists);
    assert_int_equal(count_tokens(fixture->path), 0);
}

struct crowd {
    const char *path;
    atomic_int errors;
};

static void *add_some(void *user)
{
    struct crowd *crowd = user;
    char secret[STORE_SECRET_MAX];

    for (int i = 0; i < EACH; i++) {
        if (add(crowd->path, "ada", STORE_ROLE_USER, secret, NULL) != STORE_OK) {
            atomic_fetch_add(&crowd->errors, 1);
        }
    }
    return NULL;
}

static void writers_at_once_lose_nothing(void **state)
{
    struct fixture *fixture = *state;
    struct crowd crowd = {.path = fixture->path};
    pthread_t threads[THREADS];
    struct store_tokens tokens;

    for (int i = 0; i < THREADS; i++) {
        assert_int_equal(pthread_create(&threads[i], NULL, add_some, &crowd), 0);
    }
    /* Whoever reads meanwhile sees a whole file. */
    for (int i = 0; i < 50; i++) {
        assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_OK);
        store_tokens_clear(&tokens);
    }
    for (int i = 0; i < THREADS; i++) {
        pthread_join(threads[i], NULL);
    }
    assert_int_equal(crowd.errors, 0);
    assert_int_equal(count_tokens(fixture->path), THREADS * EACH);
}

/* A file cut short anywhere within a line, or with any field damaged, has no tokens at all. */
static void a_damaged_file_is_refused(void **state)
{
    static const char *const wrong[] = {
        "",
        "srnfd-tokens 2\n",
        "srnfd-tokens 1",
        "srnfd-tokens 1\n\n",
        "srnfd-tokens 1\ntok-1\tada\tuser\n",
        "srnfd-tokens 1\ntok-1\tada\tking\t" /* no such role */
        "0000000000000000000000000000000000000000000000000000000000000000"
        "\t1\t0\t-1\t-1\t-1\t-1\t-1\n",
        "srnfd-tokens 1\ntok-1\tada\tuser\t" /* no digest */
        "000000000000000000000000000000000000000000000000000000000000000g"
        "\t1\t0\t-1\t-1\t-1\t-1\t-1\n",
        "srnfd-tokens 1\ntok-1\tada\tuser\t" /* a quota below -1 */
        "0000000000000000000000000000000000000000000000000000000000000000"
        "\t1\t0\t-1\t-1\t-2\t-1\t-1\n",
        "srnfd-tokens 1\ntok-1\tada\tuser\t" /* a field too many */
        "0000000000000000000000000000000000000000000000000000000000000000"
        "\t1\t0\t-1\t-1\t-1\t-1\t-1\t-1\n",
    };
    struct fixture *fixture = *state;
    char secret[STORE_SECRET_MAX], *text;
    struct store_tokens tokens;
    size_t size, removed;

    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_USER, secret, NULL), STORE_OK);
    text = read_file(fixture->path, &size);
    for (size_t cut = 0; cut < size; cut++) {
        bool whole = cut > 0 && text[cut - 1] == '\n';

        write_file(fixture->path, text, cut);
        assert_int_equal(store_tokens_load(fixture->path, &tokens),
                         whole ? STORE_OK : STORE_CORRUPT);
        assert_int_equal(tokens.n, 0);
        store_tokens_clear(&tokens);
    }
    free(text);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        write_file(fixture->path, wrong[i], strlen(wrong[i]));
        assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_CORRUPT);
        assert_null(tokens.list);
        /* Nor is it written over. */
        assert_int_equal(add(fixture->path, "ben", STORE_ROLE_USER, secret, NULL), STORE_CORRUPT);
        assert_int_equal(store_token_revoke(fixture->path, "ada", &removed), STORE_CORRUPT);
    }
    write_file(fixture->path, "srnfd-tokens 1\n\0", 16);
    assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_CORRUPT);
}

static void names_are_checked(void **state)
{
    (void)state;
    assert_true(store_token_name_valid("ada.lovelace_1@lab-2"));
    assert_false(store_token_name_valid(""));
    assert_false(store_token_name_valid("a b"));
    assert_false(store_token_name_valid("a\tb"));
    assert_false(store_token_name_valid("a\nb"));
    assert_false(store_token_name_valid("\xc3\xa4"));
    assert_true(
        store_token_name_valid("0123456789012345678901234567890123456789012345678901234567890123"));
    assert_false(store_token_name_valid(
        "01234567890123456789012345678901234567890123456789012345678901234"));
}

static void uses_are_read_beside_a_daemon(void **state)
{
    struct fixture *fixture = *state;
    char secret[STORE_SECRET_MAX], id[STORE_TOKEN_ID_MAX];
    struct store_tokens tokens;

    assert_int_equal(add(fixture->path, "ada", STORE_ROLE_USER, secret, id), STORE_OK);
    assert_int_equal(store_tokens_load(fixture->path, &tokens), STORE_OK);
    store_tokens_uses(fixture->path, &tokens); /* no database yet */
    assert_int_equal(tokens.list[0].last_ms, 0);
    fixture->store = fixture_store(fixture->path);
    assert_int_equal(store_token_used(fixture->store, id, 123), STORE_OK);
    assert_int_equal(store_token_used(fixture->store, id, 456), STORE_OK);
    store_tokens_uses(fixture->path, &tokens);
    assert_int_equal(tokens.list[0].last_ms, 456);
    store_close(fixture->store);
    fixture->store = NULL;
    tokens.list[0].last_ms = 0;
    store_tokens_uses(fixture->path, &tokens);
    assert_int_equal(tokens.list[0].last_ms, 456);
    store_tokens_clear(&tokens);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
#define TEST(name) cmocka_unit_test_setup_teardown(name, fixture_setup_closed, fixture_teardown)
        TEST(a_token_is_found_by_its_secret_alone), TEST(the_file_is_its_owners_alone),
        TEST(thousands_are_looked_up_at_once),      TEST(a_revoked_token_is_gone),
        TEST(writers_at_once_lose_nothing),         TEST(a_damaged_file_is_refused),
        cmocka_unit_test(names_are_checked),        TEST(uses_are_read_beside_a_daemon),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
