/*
 * names_shim.c - names_shim.so: loaded before the C library (LD_PRELOAD) into a daemon under test.
 * To look up slow.test takes 40 s, and then it is this machine; other names are not touched.
 */
#include <dlfcn.h>
#include <netdb.h>
#include <string.h>
#include <time.h>

#define SECONDS 40

typedef int lookup(const char *name, const char *service, const struct addrinfo *hints,
                   struct addrinfo **found);

int getaddrinfo(const char *name, const char *service, const struct addrinfo *hints,
                struct addrinfo **found)
{
    lookup *next;
    void *symbol = dlsym(RTLD_NEXT, "getaddrinfo");

    memcpy(&next, &symbol, sizeof next); /* ISO C has no cast between the two */
    if (name && strcmp(name, "slow.test") == 0) {
        const struct timespec time = {.tv_sec = SECONDS};

        (void)nanosleep(&time, NULL);
        name = "127.0.0.1";
    }
    return next(name, service, hints, found);
}
