/*
 * fault.c - the handler of faults, and the file in which it notes the job at fault.
 *
 * A daemon that dies of SIGSEGV and the like takes all running jobs with it, and most often one of
 * them is the reason: the one that the thread at fault was computing. Each thread keeps the id of
 * its job in a thread-local variable (workers and those that help them in a loop; others have
 * none). The handler writes
 *
 *   one line to standard error, past the log's own buffer, with the signal, the job and its process
 *   the job's id over the beginning of DATA/fault, a file of RECORD bytes made at the start, so
 *   that neither a full disk nor a lack of descriptors stops it
 *
 * and raises the signal again with its own action: the process ends, and dumps core, as without a
 * handler. At the next start that job alone has failed (store_job_recover); those that ran
 * beside it are put back, and no death is counted with them.
 *
 * All that the handler calls is async-signal-safe: write, pwrite, sigaction, raise. Of several
 * threads at fault the first one writes; the others wait for the end. The handler runs on a stack
 * of its own where the thread has one (fault_thread). Its state is the process's, as signals are:
 * static, and atomic where threads meet.
 */
#include "jobs/fault.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define RECORD 128
#define STACK_SIZE ((size_t)64 << 10)

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif

#ifndef SANITIZED
static const struct {
    int number;
    const char *name;
} signals[] = {{SIGSEGV, "SIGSEGV"},
               {SIGBUS, "SIGBUS"},
               {SIGFPE, "SIGFPE"},
               {SIGILL, "SIGILL"},
               {SIGABRT, "SIGABRT"}};
#define N_SIGNALS (sizeof signals / sizeof signals[0])
#endif

static _Thread_local const char *current_job, *current_process;
static atomic_int record = -1; /* descriptor of the file */

static bool is_id(const char *text)
{
    size_t length =
        strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_");

    return length > 0 && length < STORE_ID_MAX && text[length] == '\n';
}

bool fault_open(const char *folder, char job[STORE_ID_MAX])
{
    char path[4096], text[RECORD + 1] = "";
    int fd;

    job[0] = '\0';
    if (snprintf(path, sizeof path, "%s/fault", folder) >= (int)sizeof path) {
        errno = ENAMETOOLONG;
        return false;
    }
    fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (fd < 0) {
        return false;
    }
    if (pread(fd, text, RECORD, 0) > 0 && is_id(text)) {
        (void)snprintf(job, STORE_ID_MAX, "%.*s", (int)strcspn(text, "\n"), text);
    }
    errno = posix_fallocate(fd, 0, RECORD);
    if (errno != 0) {
        (void)close(fd);
        return false;
    }
    atomic_store(&record, fd);
    return true;
}

void fault_clear(void)
{
    static const char blank[RECORD];
    int fd = atomic_load(&record);

    if (fd >= 0 && pwrite(fd, blank, sizeof blank, 0) == (ssize_t)sizeof blank) {
        (void)fdatasync(fd);
    }
}

void fault_close(void)
{
    int fd = atomic_exchange(&record, -1);

    if (fd >= 0) {
        (void)close(fd);
    }
}

void fault_enter(const char *job, const char *process)
{
    current_job = job;
    current_process = process;
}

void fault_thread(void)
{
    static _Thread_local char stack[STACK_SIZE];
    const stack_t alternate = {.ss_sp = stack, .ss_size = sizeof stack};

#ifndef SANITIZED
    (void)sigaltstack(&alternate, NULL);
#else
    (void)alternate;
#endif
}

#ifndef SANITIZED
/* Appends as much of the text as there is room for. */
static size_t append(char *line, size_t length, size_t size, const char *text)
{
    while (*text && length < size) {
        line[length++] = *text++;
    }
    return length;
}

static void tell(int number)
{
    const char *const parts[] = {"{\"level\":\"error\",\"event\":\"fault\",\"signal\":\"",
                                 NULL,
                                 "\",\"job\":\"",
                                 current_job ? current_job : "no job",
                                 "\",\"process\":\"",
                                 current_process ? current_process : "",
                                 "\"}\n"};
    char line[400];
    size_t length = 0;

    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        const char *part = parts[i] ? parts[i] : "?";

        for (size_t k = 0; !parts[i] && k < N_SIGNALS; k++) {
            part = signals[k].number == number ? signals[k].name : part;
        }
        length = append(line, length, sizeof line, part);
    }
    (void)!write(STDERR_FILENO, line, length);
}

static void note_job(void)
{
    char text[RECORD] = "";
    size_t length = append(text, 0, sizeof text - 1, current_job ? current_job : "no job");
    int fd = atomic_load(&record);

    text[length] = '\n';
    if (fd >= 0 && pwrite(fd, text, sizeof text, 0) == (ssize_t)sizeof text) {
        (void)fdatasync(fd);
    }
}

static void on_fault(int number)
{
    static atomic_flag taken = ATOMIC_FLAG_INIT;
    struct sigaction action;

    if (atomic_flag_test_and_set(&taken)) {
        for (;;) {
            (void)pause();
        }
    }
    tell(number);
    note_job();
    memset(&action, 0, sizeof action);
    action.sa_handler = SIG_DFL;
    (void)sigaction(number, &action, NULL);
    (void)raise(number); /* comes when the handler returns */
}
#endif

void fault_watch(void)
{
#ifndef SANITIZED
    struct sigaction action;

    memset(&action, 0, sizeof action);
    action.sa_handler = on_fault;
    action.sa_flags = SA_ONSTACK;
    (void)sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < N_SIGNALS; i++) {
        (void)sigaction(signals[i].number, &action, NULL);
    }
#endif
}
