/*
 * remote_rules.c - where links may lead (remote.h).
 *
 * An address is judged in the form in which libcurl's own parser gives it back, and that form is
 * what is asked for, so that no two parsers can disagree about it. Its path has no dot segments
 * then; escapes that another server may decode to dots, slashes or backslashes are refused, since
 * they could lead out of a prefix. A name and password in an address are refused, too.
 *
 * A host's name says little: whoever has the name chooses what it stands for, at any time. So each
 * connection is judged once more by the address that it is opened to. Public is what is not set
 * aside for other uses (RFC 6890 and its successors in IANA's registries): of version 6 only
 * 2000::/3 without the blocks below, so that an embedded address of version 4, as NAT64 has it, is
 * none.
 *
 * Networks of version 4 are kept as version 6 maps them (::ffff:0:0/96).
 */
#include "api/remote.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define PREFIXES_MAX 32
#define NETWORKS_MAX 32
#define HOST_MAX 256
#define MAPPED_BITS 96 /* before an address of version 4 */

struct network {
    unsigned char bytes[16];
    unsigned bits;
};

/* An address in its parts. */
struct address {
    bool secure;
    char host[HOST_MAX], port[8], path[REMOTE_URL_MAX];
};

struct remote_rules {
    struct address prefixes[PREFIXES_MAX];
    struct network networks[NETWORKS_MAX];
    size_t n_prefixes, n_networks;
};

static const char *const special[] = {
    "0.0.0.0/8",     "10.0.0.0/8",      "100.64.0.0/10",  "127.0.0.0/8",    "169.254.0.0/16",
    "172.16.0.0/12", "192.0.0.0/24",    "192.0.2.0/24",   "192.88.99.0/24", "192.168.0.0/16",
    "198.18.0.0/15", "198.51.100.0/24", "203.0.113.0/24", "224.0.0.0/4",    "240.0.0.0/4",
    "2001::/23",     "2001:db8::/32",   "2002::/16",      "3fff::/20",
};

/* ---- Networks -------------------------------------------------------------------------------- */

static void map_address(const void *four, unsigned char bytes[16])
{
    memset(bytes, 0, 10);
    memset(bytes + 10, 0xff, 2);
    memcpy(bytes + 12, four, 4);
}

static bool read_network(const char *text, struct network *network)
{
    const char *slash = strchr(text, '/');
    size_t length = slash ? (size_t)(slash - text) : strlen(text);
    char host[INET6_ADDRSTRLEN], *end;
    struct in_addr four;
    unsigned most = 128, first = 0;
    unsigned long bits;

    if (length >= sizeof host) {
        return false;
    }
    memcpy(host, text, length);
    host[length] = '\0';
    if (inet_pton(AF_INET, host, &four) == 1) {
        map_address(&four, network->bytes);
        most = 32;
        first = MAPPED_BITS;
    } else if (inet_pton(AF_INET6, host, network->bytes) != 1) {
        return false;
    }
    bits = slash && slash[1] >= '0' && slash[1] <= '9' ? strtoul(slash + 1, &end, 10) : most;
    if (slash && (slash[1] < '0' || slash[1] > '9' || *end || bits > most)) {
        return false;
    }
    network->bits = first + (unsigned)bits;
    return true;
}

static bool is_in(const struct network *network, const unsigned char bytes[16])
{
    size_t whole = network->bits / 8;
    unsigned rest = network->bits % 8;

    return memcmp(network->bytes, bytes, whole) == 0 &&
           (rest == 0 || ((network->bytes[whole] ^ bytes[whole]) >> (8 - rest)) == 0);
}

static bool is_public(const unsigned char bytes[16])
{
    static const unsigned char mapped[12] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};

    if (memcmp(bytes, mapped, sizeof mapped) != 0 && (bytes[0] & 0xe0) != 0x20) {
        return false;
    }
    for (size_t i = 0; i < sizeof special / sizeof special[0]; i++) {
        struct network network;

        if (!read_network(special[i], &network) || is_in(&network, bytes)) {
            return false;
        }
    }
    return true;
}

bool remote_reaches(const struct remote_rules *rules, const struct sockaddr *address)
{
    unsigned char bytes[16];

    if (address->sa_family == AF_INET) {
        struct sockaddr_in four;

        memcpy(&four, address, sizeof four);
        map_address(&four.sin_addr, bytes);
    } else if (address->sa_family == AF_INET6) {
        struct sockaddr_in6 six;

        memcpy(&six, address, sizeof six);
        memcpy(bytes, &six.sin6_addr, sizeof bytes);
    } else {
        return false;
    }
    for (size_t i = 0; i < rules->n_networks; i++) {
        if (is_in(&rules->networks[i], bytes)) {
            return true;
        }
    }
    return is_public(bytes);
}

/* ---- Addresses ------------------------------------------------------------------------------- */

/* Characters that an address is written with, and no escape that hides one that leads elsewhere. */
static bool is_plain(const char *text)
{
    if (strlen(text) >= REMOTE_URL_MAX) {
        return false;
    }
    for (const char *at = text; *at; at++) {
        if (*at <= ' ' || *at > '~' || *at == '\\') {
            return false;
        }
        if (*at == '%' && (strncasecmp(at, "%2e", 3) == 0 || strncasecmp(at, "%2f", 3) == 0 ||
                           strncasecmp(at, "%5c", 3) == 0 || strncmp(at, "%0", 2) == 0 ||
                           strncmp(at, "%1", 2) == 0)) {
            return false;
        }
    }
    return true;
}

static bool take_part(CURLU *url, CURLUPart part, char *text, size_t size)
{
    unsigned flags = part == CURLUPART_PORT ? CURLU_DEFAULT_PORT : 0;
    char *value = NULL;
    bool taken = curl_url_get(url, part, &value, flags) == CURLUE_OK && strlen(value) < size;

    if (taken) {
        memcpy(text, value, strlen(value) + 1);
    }
    curl_free(value);
    return taken;
}

/* Whether a host follows the scheme: libcurl would pass over a third slash. */
static bool names_host(const char *text)
{
    const char *rest = strstr(text, "://");

    return rest && rest[3] && rest[3] != '/';
}

/* The address in its parts and, where normal is not NULL, in its normal form without a fragment.
   False where it is none of HTTP, or has a name or password. */
static bool read_address(const char *text, struct address *address, char normal[REMOTE_URL_MAX])
{
    CURLU *url = is_plain(text) && names_host(text) ? curl_url() : NULL;
    char scheme[8];
    bool read = url && curl_url_set(url, CURLUPART_URL, text, CURLU_DISALLOW_USER) == CURLUE_OK &&
                curl_url_set(url, CURLUPART_FRAGMENT, NULL, 0) == CURLUE_OK &&
                take_part(url, CURLUPART_SCHEME, scheme, sizeof scheme) &&
                take_part(url, CURLUPART_HOST, address->host, sizeof address->host) &&
                take_part(url, CURLUPART_PORT, address->port, sizeof address->port) &&
                take_part(url, CURLUPART_PATH, address->path, sizeof address->path) &&
                (!normal || take_part(url, CURLUPART_URL, normal, REMOTE_URL_MAX));

    address->secure = read && strcmp(scheme, "https") == 0;
    read = read && (address->secure || strcmp(scheme, "http") == 0);
    curl_url_cleanup(url);
    return read;
}

static bool lies_under(const struct address *address, const struct address *prefix)
{
    return address->secure == prefix->secure && strcasecmp(address->host, prefix->host) == 0 &&
           strcmp(address->port, prefix->port) == 0 &&
           strncmp(address->path, prefix->path, strlen(prefix->path)) == 0;
}

bool remote_permits(const struct remote_rules *rules, const char *address, char url[REMOTE_URL_MAX])
{
    struct address read;

    if (!remote_enabled(rules) || !read_address(address, &read, url)) {
        return false;
    }
    for (size_t i = 0; i < rules->n_prefixes; i++) {
        if (lies_under(&read, &rules->prefixes[i])) {
            return true;
        }
    }
    return false;
}

bool remote_enabled(const struct remote_rules *rules)
{
    return rules && rules->n_prefixes > 0;
}

/* ---- The settings ---------------------------------------------------------------------------- */

static const char *add_prefix(struct remote_rules *rules, const char *text)
{
    struct address *prefix = &rules->prefixes[rules->n_prefixes];

    if (rules->n_prefixes == PREFIXES_MAX) {
        return "there are more than 32";
    }
    /* The path as written, since that of http://host is / to libcurl. */
    if (!read_address(text, prefix, NULL) || strpbrk(text, "?#") || text[strlen(text) - 1] != '/' ||
        prefix->path[strlen(prefix->path) - 1] != '/') {
        return "each is http:// or https://, a host, and a path that ends in a slash";
    }
    rules->n_prefixes++;
    return NULL;
}

static const char *add_network(struct remote_rules *rules, const char *text)
{
    if (rules->n_networks == NETWORKS_MAX) {
        return "there are more than 32";
    }
    if (!read_network(text, &rules->networks[rules->n_networks])) {
        return "each is an address, or a network such as 10.1.0.0/16 or fd00::/8";
    }
    rules->n_networks++;
    return NULL;
}

/* Each part of the list, without blanks around it. */
static bool read_list(struct remote_rules *rules, const char *setting, const char *list,
                      const char *(*add)(struct remote_rules *rules, const char *text),
                      char *message, size_t size)
{
    while (*list) {
        size_t length = strcspn(list, ","), skip = strspn(list, " ");
        const char *problem = "one is too long";
        char text[REMOTE_URL_MAX];

        if (skip < length && length - skip < sizeof text) {
            size_t end = length;

            while (list[end - 1] == ' ') {
                end--;
            }
            memcpy(text, list + skip, end - skip);
            text[end - skip] = '\0';
            problem = add(rules, text);
        } else if (skip >= length) {
            problem = "one is empty";
        }
        if (problem) {
            (void)snprintf(message, size, "%s %.120s: %s", setting, list, problem);
            return false;
        }
        list += length + (list[length] == ',');
    }
    return true;
}

struct remote_rules *remote_rules_read(const char *prefixes, const char *networks, char *message,
                                       size_t size)
{
    struct remote_rules *rules = calloc(1, sizeof *rules);

    if (!rules || curl_global_init(CURL_GLOBAL_DEFAULT) != 0) {
        (void)snprintf(message, size, "not enough memory");
        free(rules);
        return NULL;
    }
    if (!read_list(rules, "--link-prefixes", prefixes, add_prefix, message, size) ||
        !read_list(rules, "--link-networks", networks, add_network, message, size)) {
        remote_rules_free(rules);
        return NULL;
    }
    return rules;
}

void remote_rules_free(struct remote_rules *rules)
{
    if (rules) {
        curl_global_cleanup();
        free(rules);
    }
}
