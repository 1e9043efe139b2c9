/*
 * fold.c - the SQL function folded(text): small letters for capital ones, of all scripts, by which
 * names are searched and sorted. The daemon sets no locale; the letters are those of C.UTF-8, or of
 * ASCII alone where a system lacks it.
 *
 * A letter with its marks is one character before (Unicode's form NFC, by utf8proc), so that names
 * as macOS writes them, in the form NFD, are found by what a keyboard gives.
 */
#include "store/fold.h"

#include <locale.h>
#include <stdlib.h>
#include <string.h>
#include <utf8proc.h>
#include <wctype.h>

/* The character at *at, of which *length bytes are looked at; a byte that begins none stands for
   itself, and *good is false. */
static wint_t decode(const unsigned char *at, size_t left, size_t *length, bool *good)
{
    static const struct {
        unsigned char mask, lead;
        unsigned least;
    } forms[] = {{0x80, 0x00, 0}, {0xe0, 0xc0, 0x80}, {0xf0, 0xe0, 0x800}, {0xf8, 0xf0, 0x10000}};
    unsigned value = *at;

    *length = 1;
    *good = true;
    for (size_t n = 0; n < 4; n++) {
        if ((*at & forms[n].mask) != forms[n].lead || n + 1 > left) {
            continue;
        }
        value = *at & (unsigned char)~forms[n].mask;
        for (size_t i = 1; i <= n; i++) {
            *good = *good && (at[i] & 0xc0) == 0x80;
            value = value << 6 | (at[i] & 0x3f);
        }
        *good = *good && value >= forms[n].least && value < 0x110000;
        *length = *good ? n + 1 : 1;
        return *good ? value : *at;
    }
    *good = false;
    return value;
}

static size_t encode(wint_t c, unsigned char out[4])
{
    if (c < 0x80) {
        out[0] = (unsigned char)c;
        return 1;
    }
    if (c < 0x800) {
        out[0] = (unsigned char)(0xc0 | c >> 6);
        out[1] = (unsigned char)(0x80 | (c & 0x3f));
        return 2;
    }
    if (c < 0x10000) {
        out[0] = (unsigned char)(0xe0 | c >> 12);
        out[1] = (unsigned char)(0x80 | (c >> 6 & 0x3f));
        out[2] = (unsigned char)(0x80 | (c & 0x3f));
        return 3;
    }
    out[0] = (unsigned char)(0xf0 | c >> 18);
    out[1] = (unsigned char)(0x80 | (c >> 12 & 0x3f));
    out[2] = (unsigned char)(0x80 | (c >> 6 & 0x3f));
    out[3] = (unsigned char)(0x80 | (c & 0x3f));
    return 4;
}

/* What most names are: whether there is nothing to be done, or nothing but ASCII. */
static bool is_small(const unsigned char *text, size_t size, bool *ascii)
{
    unsigned char any = 0;
    bool capital = false;

    for (size_t i = 0; i < size; i++) {
        any |= text[i];
        capital |= (unsigned char)(text[i] - 'A') < 26;
    }
    *ascii = any < 0x80;
    return *ascii && !capital;
}

static size_t fold(const unsigned char *text, size_t size, bool ascii, locale_t locale,
                   unsigned char *out)
{
    size_t used = 0, length = 1;

    for (size_t i = 0; i < size; i += length) {
        bool good = true;
        wint_t c = ascii ? text[i] : decode(text + i, size - i, &length, &good);

        if (c < 0x80 || !good) {
            bool capital = c >= 'A' && c <= 'Z';

            out[used++] = (unsigned char)(text[i] + (capital ? 32 : 0));
        } else {
            used += encode(locale ? towlower_l(c, locale) : c, out + used);
        }
    }
    return used;
}

/* The text in the form NFC, to be freed; NULL without memory, and of what is no UTF-8, which stays
   as it is. */
static unsigned char *compose(const unsigned char *text, size_t *size, bool *lacking)
{
    utf8proc_uint8_t *composed = NULL;
    utf8proc_ssize_t length =
        utf8proc_map(text, (utf8proc_ssize_t)*size, &composed, UTF8PROC_STABLE | UTF8PROC_COMPOSE);

    *lacking = length == UTF8PROC_ERROR_NOMEM;
    *size = length < 0 ? *size : (size_t)length;
    return length < 0 ? NULL : composed;
}

/* A small letter may take more bytes than its capital one: up to three for two. */
static void folded(sqlite3_context *context, int count, sqlite3_value **values)
{
    const unsigned char *text = sqlite3_value_text(values[0]);
    size_t size = (size_t)sqlite3_value_bytes(values[0]);
    unsigned char *out, *composed = NULL;
    bool ascii, lacking = false;

    (void)count;
    if (!text || is_small(text, size, &ascii)) {
        sqlite3_result_value(context, values[0]);
        return;
    }
    if (!ascii) {
        composed = compose(text, &size, &lacking);
        text = composed ? composed : text;
    }
    out = lacking ? NULL : sqlite3_malloc64(2 * size + 4);
    if (!out) {
        free(composed);
        sqlite3_result_error_nomem(context);
        return;
    }
    size = fold(text, size, ascii, sqlite3_user_data(context), out);
    free(composed);
    sqlite3_result_text64(context, (char *)out, size, sqlite3_free, SQLITE_UTF8);
}

static void forget(void *locale)
{
    if (locale) {
        freelocale(locale);
    }
}

int store_fold_define(sqlite3 *db)
{
    locale_t letters = newlocale(LC_CTYPE_MASK, "C.UTF-8", (locale_t)0);

    return sqlite3_create_function_v2(db, "folded", 1,
                                      SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS,
                                      letters, folded, NULL, NULL, forget);
}
