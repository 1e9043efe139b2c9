/*
 * tls.c - the certificate that the daemon shows, by GnuTLS below libmicrohttpd.
 *
 * libmicrohttpd cannot change its credentials while it runs, but asks a callback for them at each
 * handshake. The callback looks at the two files (stat), and where they were replaced reads them
 * anew; a pair that cannot be used, as between the writing of the one and of the other, is passed
 * over, and the pair before stays. So a renewed certificate is shown from the next connection on,
 * without a signal, and connections that are open keep theirs.
 *
 * Each handshake gets its own copies, parsed from the texts in memory, and GnuTLS frees them: no
 * handshake that is under way refers to what a reload replaces. Parsing costs some tens of
 * microseconds beside a millisecond or so of the handshake.
 *
 * Threads: the callback runs on libmicrohttpd's. Lock: tls->mutex protects the texts and stamps;
 * it is innermost, held while files of some kilobytes are read.
 */
#include "http/internal.h"

#include "log.h"

#include <gnutls/abstract.h>
#include <gnutls/gnutls.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define CHAIN_MAX 16 /* certificates of one file */
/* TLS 1.2 with forward secrecy and authenticated encryption alone, or TLS 1.3. */
#define PRIORITIES "NORMAL:-VERS-TLS1.0:-VERS-TLS1.1:-RSA:-AES-128-CBC:-AES-256-CBC:-SHA1"

struct stamp {
    dev_t device;
    ino_t inode;
    off_t size;
    struct timespec modified, changed;
};

struct tls {
    pthread_mutex_t mutex;
    char *certificate_path, *key_path;
    struct stamp stamps[2];          /* of the files as last read */
    gnutls_datum_t certificate, key; /* PEM, of gnutls_malloc: a pair that fits */
};

static struct stamp look(const char *path)
{
    struct stat info;

    if (stat(path, &info) != 0) {
        return (struct stamp){.size = -1};
    }
    return (struct stamp){info.st_dev, info.st_ino, info.st_size, info.st_mtim, info.st_ctim};
}

static bool same_time(const struct timespec *a, const struct timespec *b)
{
    return a->tv_sec == b->tv_sec && a->tv_nsec == b->tv_nsec;
}

static bool same(const struct stamp *a, const struct stamp *b)
{
    return a->device == b->device && a->inode == b->inode && a->size == b->size &&
           same_time(&a->modified, &b->modified) && same_time(&a->changed, &b->changed);
}

/* 0 where certificate and key are a pair, otherwise GnuTLS's code. */
static int check_pair(const gnutls_datum_t *certificate, const gnutls_datum_t *key)
{
    gnutls_certificate_credentials_t credentials = NULL;
    int status = gnutls_certificate_allocate_credentials(&credentials);

    if (status == 0) {
        status =
            gnutls_certificate_set_x509_key_mem(credentials, certificate, key, GNUTLS_X509_FMT_PEM);
        gnutls_certificate_free_credentials(credentials);
    }
    return status < 0 ? status : 0;
}

/* Reads both files; keeps what is there where they are no pair. Returns GnuTLS's code. The mutex is
   held, or nobody else knows tls yet. */
static int load(struct tls *tls)
{
    gnutls_datum_t certificate = {NULL, 0}, key = {NULL, 0};
    int status;

    tls->stamps[0] = look(tls->certificate_path);
    tls->stamps[1] = look(tls->key_path);
    status = gnutls_load_file(tls->certificate_path, &certificate);
    if (status == 0) {
        status = gnutls_load_file(tls->key_path, &key);
    }
    if (status == 0) {
        status = check_pair(&certificate, &key);
    }
    if (status == 0) {
        gnutls_free(tls->certificate.data);
        gnutls_free(tls->key.data);
        tls->certificate = certificate;
        tls->key = key;
    } else {
        gnutls_free(certificate.data);
        gnutls_free(key.data);
    }
    return status;
}

/* Takes notice of files that were replaced; the mutex is held. */
static void refresh(struct tls *tls)
{
    struct stamp certificate = look(tls->certificate_path), key = look(tls->key_path);
    int status;

    if (same(&certificate, &tls->stamps[0]) && same(&key, &tls->stamps[1])) {
        return;
    }
    status = load(tls);
    if (status == 0) {
        LOG("tls-reloaded", log_text("certificate", tls->certificate_path));
    } else {
        LOG_ERROR("tls-not-reloaded", log_text("certificate", tls->certificate_path),
                  log_text("message", gnutls_strerror(status)));
    }
}

/* A copy of the pair, of gnutls_malloc; the mutex is held. */
static int copy_pair(const struct tls *tls, gnutls_pcert_st **chain, unsigned *length,
                     gnutls_privkey_t *key)
{
    gnutls_pcert_st *list = gnutls_malloc(CHAIN_MAX * sizeof *list);
    int status = list ? 0 : GNUTLS_E_MEMORY_ERROR;

    *length = CHAIN_MAX;
    if (status == 0) {
        status = gnutls_pcert_list_import_x509_raw(list, length, &tls->certificate,
                                                   GNUTLS_X509_FMT_PEM, 0);
    }
    if (status < 0) {
        gnutls_free(list);
        return status;
    }
    status = gnutls_privkey_init(key);
    if (status == 0) {
        status = gnutls_privkey_import_x509_raw(*key, &tls->key, GNUTLS_X509_FMT_PEM, NULL, 0);
        if (status < 0) {
            gnutls_privkey_deinit(*key);
        }
    }
    if (status < 0) {
        for (unsigned i = 0; i < *length; i++) {
            gnutls_pcert_deinit(&list[i]);
        }
        gnutls_free(list);
        return status;
    }
    *chain = list;
    return 0;
}

/* Called by GnuTLS in each handshake; libmicrohttpd has made its connection the session's pointer.
 */
static int retrieve(gnutls_session_t session, const struct gnutls_cert_retr_st *info,
                    gnutls_pcert_st **chain, unsigned *length, gnutls_ocsp_data_st **responses,
                    unsigned *n_responses, gnutls_privkey_t *key, unsigned *flags)
{
    struct connection *connection = connection_of(gnutls_session_get_ptr(session));
    struct tls *tls = connection ? connection->http->tls : NULL;
    int status;

    (void)info;
    *responses = NULL;
    *n_responses = 0;
    if (!tls) {
        return -1;
    }
    (void)pthread_mutex_lock(&tls->mutex);
    refresh(tls);
    status = copy_pair(tls, chain, length, key);
    (void)pthread_mutex_unlock(&tls->mutex);
    *flags = GNUTLS_CERT_RETR_DEINIT_ALL;
    return status < 0 ? -1 : 0;
}

struct tls *tls_open(const char *certificate, const char *key, char *message, size_t size)
{
    struct tls *tls = calloc(1, sizeof *tls);
    int status = GNUTLS_E_MEMORY_ERROR;

    if (tls) {
        (void)pthread_mutex_init(&tls->mutex, NULL);
        tls->certificate_path = strdup(certificate);
        tls->key_path = strdup(key);
        status = tls->certificate_path && tls->key_path ? load(tls) : status;
    }
    if (status != 0) {
        (void)snprintf(message, size,
                       "the certificate %.200s and the key %.200s cannot be used: %s", certificate,
                       key, gnutls_strerror(status));
        tls_close(tls);
        tls = NULL;
    }
    return tls;
}

void tls_close(struct tls *tls)
{
    if (tls) {
        gnutls_free(tls->certificate.data);
        gnutls_free(tls->key.data);
        free(tls->certificate_path);
        free(tls->key_path);
        (void)pthread_mutex_destroy(&tls->mutex);
        free(tls);
    }
}

void tls_options(const struct tls *tls, struct MHD_OptionItem options[TLS_OPTIONS])
{
    union {
        gnutls_certificate_retrieve_function3 *function;
        void *pointer;
    } callback = {retrieve};
    union {
        const char *constant;
        void *pointer;
    } priorities = {PRIORITIES};
    size_t n = 0;

    if (tls) {
        options[n++] =
            (struct MHD_OptionItem){MHD_OPTION_HTTPS_CERT_CALLBACK2, 0, callback.pointer};
        options[n++] = (struct MHD_OptionItem){MHD_OPTION_HTTPS_PRIORITIES, 0, priorities.pointer};
    }
    options[n] = (struct MHD_OptionItem){MHD_OPTION_END, 0, NULL};
}
