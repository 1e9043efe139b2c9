/*
 * test_remote_rules.c - where links may lead: prefixes, the forms of an address that lead out of
 * them, and which addresses of the Internet Protocol a connection may be opened to.
 */
#include "api/remote.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static struct remote_rules *rules_of(const char *prefixes, const char *networks)
{
    char message[300] = "";
    struct remote_rules *rules = remote_rules_read(prefixes, networks, message, sizeof message);

    if (!rules) {
        fail_msg("%s", message);
    }
    return rules;
}

static void assert_refused(const char *prefixes, const char *networks, const char *setting)
{
    char message[300] = "";

    assert_null(remote_rules_read(prefixes, networks, message, sizeof message));
    assert_non_null(strstr(message, setting));
}

static void settings_are_read_strictly(void **state)
{
    static const char *const prefixes[] = {
        "data.example",
        "https://data.example/meshes",
        "ftp://data.example/",
        "https://ada@data.example/",
        "https://data.example/?",
        "https://data.example/#/",
        "https://data.example",
        "https:///",
        "https:///data.example/",
        "https:////data.example/",
        "https://data.example/%2e%2e/",
        ",",
    };
    static const char *const networks[] = {
        "data.example", "10.0.0.0/33", "10.0.0/8", "10.0.0.0/",
        "10.0.0.0/8x",  "::/129",      ",",        "fe80::1%eth0"};

    (void)state;
    for (size_t i = 0; i < sizeof prefixes / sizeof prefixes[0]; i++) {
        assert_refused(prefixes[i], "", "--link-prefixes");
    }
    for (size_t i = 0; i < sizeof networks / sizeof networks[0]; i++) {
        assert_refused("https://data.example/", networks[i], "--link-networks");
    }
}

static void without_prefixes_nothing_is_fetched(void **state)
{
    struct remote_rules *rules = rules_of("", "10.0.0.0/8");
    char url[REMOTE_URL_MAX];

    (void)state;
    assert_false(remote_enabled(NULL));
    assert_false(remote_enabled(rules));
    assert_false(remote_permits(rules, "https://data.example/a.ply", url));
    remote_rules_free(rules);
}

static void addresses_lie_under_a_prefix(void **state)
{
    struct remote_rules *rules =
        rules_of("https://data.example/meshes/, http://10.1.2.3:8080/,http://[2001:db8::1]/a/", "");
    static const struct {
        const char *address, *url;
    } good[] = {
        {"https://data.example/meshes/a.ply", "https://data.example/meshes/a.ply"},
        {"HTTPS://DATA.EXAMPLE:443/meshes/a.ply?b=c#d", NULL},
        {"https://data.example/meshes/b/../a.ply", "https://data.example/meshes/a.ply"},
        {"https://data.example/x/../meshes/a.ply", "https://data.example/meshes/a.ply"},
        {"http://10.1.2.3:8080/", NULL},
        {"http://[2001:DB8::1]/a/b", NULL},
    };
    static const char *const bad[] = {
        "http://data.example/meshes/a.ply", /* another scheme */
        "https://data.example:444/meshes/a.ply",
        "https://data.example/meshes",
        "https://data.example/meshesa.ply",
        "https://data.example/meshes/../a.ply",
        "https://data.example/meshes/./../a.ply",
        "https://data.example/meshes/%2e%2e/a.ply",
        "https://data.example/meshes/.%2E/a.ply",
        "https://data.example/meshes/..%2fa.ply",
        "https://data.example/meshes/..%5Ca.ply",
        "https://data.example/meshes/..\\a.ply",
        "https://data.example/meshes/a.ply\r\nHost: b",
        "https://data.example/meshes/a b",
        "https://data.example/meshes/a%0d%0a",
        "https://data.example/meshes/\xc3\xa4",
        "https://data.example@evil.example/meshes/",
        "https://evil.example/https://data.example/meshes/",
        "https://data.example.evil.example/meshes/a.ply",
        "https://data.example./meshes/a.ply",
        "https://ada:secret@data.example/meshes/a.ply",
        "data.example/meshes/a.ply",
        "//data.example/meshes/a.ply",
        "https:/data.example/meshes/a.ply",
        "https:///data.example/meshes/a.ply",
        "file:///data.example/meshes/a.ply",
        "http://[2001:db8::1%25eth0]:81/a/b",
        "",
    };
    char url[REMOTE_URL_MAX];

    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        if (!remote_permits(rules, good[i].address, url)) {
            fail_msg("%s is refused", good[i].address);
        }
        if (good[i].url) {
            assert_string_equal(url, good[i].url);
        }
        assert_null(strchr(url, '#'));
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (remote_permits(rules, bad[i], url)) {
            fail_msg("%s is permitted, as %s", bad[i], url);
        }
    }
    remote_rules_free(rules);
}

static void long_addresses_are_refused(void **state)
{
    struct remote_rules *rules = rules_of("https://data.example/", "");
    char address[2 * REMOTE_URL_MAX], url[REMOTE_URL_MAX];

    (void)state;
    for (size_t length = REMOTE_URL_MAX - 2; length < sizeof address; length++) {
        memset(address, 'a', length);
        memcpy(address, "https://data.example/", strlen("https://data.example/"));
        address[length] = '\0';
        assert_int_equal(remote_permits(rules, address, url), length < REMOTE_URL_MAX);
    }
    remote_rules_free(rules);
}

static bool reaches(const struct remote_rules *rules, const char *text)
{
    struct sockaddr_in four = {.sin_family = AF_INET};
    struct sockaddr_in6 six = {.sin6_family = AF_INET6};

    if (inet_pton(AF_INET, text, &four.sin_addr) == 1) {
        return remote_reaches(rules, (const struct sockaddr *)&four);
    }
    assert_int_equal(inet_pton(AF_INET6, text, &six.sin6_addr), 1);
    return remote_reaches(rules, (const struct sockaddr *)&six);
}

static void connections_go_to_public_addresses(void **state)
{
    struct remote_rules *rules = rules_of("https://data.example/", "");
    static const char *const good[] = {"1.1.1.1",        "93.184.216.34",        "172.32.0.1",
                                       "100.128.0.1",    "::ffff:93.184.216.34", "2606:4700::1111",
                                       "223.255.255.255"};
    static const char *const bad[] = {
        "0.0.0.0",
        "10.0.0.1",
        "127.0.0.1",
        "127.255.255.254",
        "169.254.169.254",
        "172.16.0.1",
        "172.31.255.255",
        "192.168.1.1",
        "100.64.0.1",
        "192.0.0.8",
        "198.18.0.1",
        "224.0.0.1",
        "255.255.255.255",
        "::",
        "::1",
        "::ffff:10.0.0.1",
        "::ffff:127.0.0.1",
        "::127.0.0.1",
        "64:ff9b::a00:1",
        "fe80::1",
        "fc00::1",
        "fd12::1",
        "ff02::1",
        "2001:db8::1",
        "2002:a00:1::",
        "2001::1",
        "4000::1",
    };
    const struct sockaddr local = {.sa_family = AF_UNIX};

    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        if (!reaches(rules, good[i])) {
            fail_msg("%s is public", good[i]);
        }
    }
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        if (reaches(rules, bad[i])) {
            fail_msg("%s is not public", bad[i]);
        }
    }
    assert_false(remote_reaches(rules, &local));
    remote_rules_free(rules);
}

static void networks_are_added(void **state)
{
    struct remote_rules *rules =
        rules_of("https://data.example/", "10.1.0.0/16,127.0.0.1, fd00::/8,192.168.0.0/25");

    (void)state;
    assert_true(reaches(rules, "10.1.255.255"));
    assert_true(reaches(rules, "::ffff:10.1.0.1"));
    assert_false(reaches(rules, "10.2.0.0"));
    assert_true(reaches(rules, "127.0.0.1"));
    assert_false(reaches(rules, "127.0.0.2"));
    assert_true(reaches(rules, "fd12::1"));
    assert_false(reaches(rules, "fc12::1"));
    assert_true(reaches(rules, "192.168.0.127"));
    assert_false(reaches(rules, "192.168.0.128"));
    remote_rules_free(rules);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(settings_are_read_strictly),
        cmocka_unit_test(without_prefixes_nothing_is_fetched),
        cmocka_unit_test(addresses_lie_under_a_prefix),
        cmocka_unit_test(long_addresses_are_refused),
        cmocka_unit_test(connections_go_to_public_addresses),
        cmocka_unit_test(networks_are_added),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
