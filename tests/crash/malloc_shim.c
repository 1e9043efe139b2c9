/*
 * malloc_shim.c - malloc_shim.so: loaded before the C library (LD_PRELOAD) into a daemon under
 * test, it numbers the allocations made by the daemon itself, by SQLite, jansson, libmicrohttpd
 * and expat, and lets those fail that fault.h says. Allocations of other libraries are left alone:
 * FFTW, GLPK and OpenBLAS end the process when memory is short, and offer no other way.
 *
 * Whose an allocation is, is told by the module that called; calls of the C library on behalf of
 * others (strdup, fdopendir) count as the C library's, and strdup, which the daemon uses most, is
 * therefore done here.
 */
#include "support/fault.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define MODULES_MAX 16

static struct fault_control *control;
static struct {
    uintptr_t from, to;
} modules[MODULES_MAX];
static size_t n_modules;

/* Notes the code of the modules that are watched: the program and the named libraries. */
static int note_module(struct dl_phdr_info *info, size_t size, void *user)
{
    static const char *const watched[] = {"libsqlite3", "libjansson", "libmicrohttpd", "libexpat"};
    bool mine = info->dlpi_name[0] == '\0';

    (void)size;
    (void)user;
    for (size_t i = 0; i < sizeof watched / sizeof watched[0]; i++) {
        mine |= strstr(info->dlpi_name, watched[i]) != NULL;
    }
    for (int i = 0; mine && i < info->dlpi_phnum && n_modules < MODULES_MAX; i++) {
        const ElfW(Phdr) *part = &info->dlpi_phdr[i];

        if (part->p_type == PT_LOAD && (part->p_flags & PF_X)) {
            modules[n_modules].from = (uintptr_t)info->dlpi_addr + part->p_vaddr;
            modules[n_modules].to = modules[n_modules].from + part->p_memsz;
            n_modules++;
        }
    }
    return 0;
}

__attribute__((constructor)) static void load(void)
{
    const char *file = getenv("SRNFD_FAULT_CONTROL");
    int fd = file ? open(file, O_RDWR | O_CLOEXEC) : -1;
    void *page;

    if (fd >= 0) {
        page = mmap(NULL, sizeof *control, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        close(fd);
        dl_iterate_phdr(note_module, NULL);
        control = page == MAP_FAILED ? NULL : page;
    }
}

/* Counts the allocation; true if it is to fail. */
static bool fails(const void *caller)
{
    uintptr_t at = (uintptr_t)caller;
    int64_t number;
    bool mine = false;

    if (!control || atomic_load(&control->no_memory_last) == 0) {
        return false;
    }
    for (size_t i = 0; i < n_modules && !mine; i++) {
        mine = at >= modules[i].from && at < modules[i].to;
    }
    if (!mine) {
        return false;
    }
    number = atomic_fetch_add(&control->allocations, 1) + 1;
    if (number < atomic_load(&control->no_memory_first) ||
        number > atomic_load(&control->no_memory_last)) {
        return false;
    }
    atomic_fetch_add(&control->hits, 1);
    errno = ENOMEM;
    return true;
}

#define CALLER __builtin_return_address(0)
/* The next function of this name: the C library's, or a sanitizer's. */
#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

void *malloc(size_t size)
{
    return fails(CALLER) ? NULL : REAL(malloc)(size);
}

void *calloc(size_t count, size_t size)
{
    return fails(CALLER) ? NULL : REAL(calloc)(count, size);
}

void *realloc(void *bytes, size_t size)
{
    return fails(CALLER) ? NULL : REAL(realloc)(bytes, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return fails(CALLER) ? NULL : REAL(aligned_alloc)(alignment, size);
}

char *strdup(const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = fails(CALLER) ? NULL : REAL(malloc)(size);

    return copy ? memcpy(copy, text, size) : NULL;
}
