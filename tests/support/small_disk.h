/*
 * small_disk.h - a file system of a given size over a folder, for this process and its children.
 *
 * Root has the right to mount; anybody else gets it in a user namespace of his own, where the
 * system allows these. The process must have one thread.
 */
#ifndef TESTS_SMALL_DISK_H
#define TESTS_SMALL_DISK_H

#include <fcntl.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/mount.h>
#include <unistd.h>

static inline bool small_disk_write(const char *path, const char *text)
{
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    bool written = fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text);

    return fd >= 0 && close(fd) == 0 && written;
}

/* Namespaces in which mounting is allowed and seen by nobody else; ids stay what they were. */
static inline bool small_disk_own_mounts(void)
{
    char users[64], groups[64];

    (void)snprintf(users, sizeof users, "%u %u 1", (unsigned)getuid(), (unsigned)getuid());
    (void)snprintf(groups, sizeof groups, "%u %u 1", (unsigned)getgid(), (unsigned)getgid());
    return unshare(CLONE_NEWNS) == 0 || (unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0 &&
                                         small_disk_write("/proc/self/setgroups", "deny") &&
                                         small_disk_write("/proc/self/uid_map", users) &&
                                         small_disk_write("/proc/self/gid_map", groups));
}

/* size as in "size=3m". False where neither way is open. */
static inline bool small_disk_mount(const char *path, const char *size)
{
    return small_disk_own_mounts() && mount("none", "/", NULL, MS_REC | MS_PRIVATE, NULL) == 0 &&
           mount("tmpfs", path, "tmpfs", 0, size) == 0;
}

#endif
