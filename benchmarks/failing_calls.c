/* Calls on the files of one folder that fail, or send a signal, at a given count: gcc -shared -fPIC -o x.so x.c -ldl

   Preloaded before libc. Inactive until failing_calls_set is called; a process that is started by another one is
   inactive, too. Kinds: 0 open, 1 write, 2 fsync, 3 rename; 4 stands for any of them, and for unlink, mkdir and link. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { OPEN, WRITE, FSYNC, RENAME, ANY, KINDS };
#define HANDLES 4096

static char folder[PATH_MAX];
static size_t folder_length;
static int wanted_kind, wanted_error, wanted_signal;
static long wanted_count;
static long counts[KINDS];
static char in_folder[HANDLES];

void failing_calls_set(const char *path, int kind, int count, int error, int signal_number) {
    strncpy(folder, path, sizeof folder - 1);
    folder_length = strlen(folder);
    memset(counts, 0, sizeof counts);
    wanted_kind = kind; wanted_count = count; wanted_error = error; wanted_signal = signal_number;
}

int failing_calls_count(int kind) { return (int)counts[kind]; }

static int below(const char *path) {
    return folder_length && path && strncmp(path, folder, folder_length) == 0;
}

/* 1 where this call has to fail; a signal is sent and the call goes on, unless the signal ends the process. */
static int strikes(int kind) {
    int hit = 0;
    if (kind != ANY && ++counts[kind] == wanted_count && wanted_kind == kind) hit = 1;
    if (++counts[ANY] == wanted_count && wanted_kind == ANY) hit = 1;
    if (hit && wanted_signal) { kill(getpid(), wanted_signal); hit = 0; }
    if (hit) errno = wanted_error;
    return hit;
}

#define REAL(name) \
    static __typeof__(&name) real; \
    if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static int noted(int handle, int counted) {
    if (handle >= 0 && handle < HANDLES) in_folder[handle] = (char)counted;
    return handle;
}

static int open_mode(int flags, va_list rest) { return flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, int) : 0; }

#define OPENS(name) \
    int name(const char *path, int flags, ...) { \
        REAL(name); \
        va_list rest; va_start(rest, flags); int mode = open_mode(flags, rest); va_end(rest); \
        int counted = below(path); \
        if (counted && strikes(OPEN)) return -1; \
        return noted(real(path, flags, mode), counted); \
    }
OPENS(open)
OPENS(open64)

#define OPENS_AT(name) \
    int name(int at, const char *path, int flags, ...) { \
        REAL(name); \
        va_list rest; va_start(rest, flags); int mode = open_mode(flags, rest); va_end(rest); \
        int counted = below(path); \
        if (counted && strikes(OPEN)) return -1; \
        return noted(real(at, path, flags, mode), counted); \
    }
OPENS_AT(openat)
OPENS_AT(openat64)

int close(int handle) {
    REAL(close);
    if (handle >= 0 && handle < HANDLES) in_folder[handle] = 0;
    return real(handle);
}

static int ours(int handle) { return handle >= 0 && handle < HANDLES && in_folder[handle]; }

ssize_t write(int handle, const void *data, size_t size) {
    REAL(write);
    return ours(handle) && strikes(WRITE) ? -1 : real(handle, data, size);
}
ssize_t pwrite(int handle, const void *data, size_t size, off_t at) {
    REAL(pwrite);
    return ours(handle) && strikes(WRITE) ? -1 : real(handle, data, size, at);
}
ssize_t pwrite64(int handle, const void *data, size_t size, off64_t at) {
    REAL(pwrite64);
    return ours(handle) && strikes(WRITE) ? -1 : real(handle, data, size, at);
}
ssize_t writev(int handle, const struct iovec *parts, int count) {
    REAL(writev);
    return ours(handle) && strikes(WRITE) ? -1 : real(handle, parts, count);
}
int fsync(int handle) {
    REAL(fsync);
    return ours(handle) && strikes(FSYNC) ? -1 : real(handle);
}
int fdatasync(int handle) {
    REAL(fdatasync);
    return ours(handle) && strikes(FSYNC) ? -1 : real(handle);
}
int rename(const char *from, const char *to) {
    REAL(rename);
    return below(to) && strikes(RENAME) ? -1 : real(from, to);
}
int renameat(int at, const char *from, int there, const char *to) {
    REAL(renameat);
    return below(to) && strikes(RENAME) ? -1 : real(at, from, there, to);
}
int renameat2(int at, const char *from, int there, const char *to, unsigned int flags) {
    REAL(renameat2);
    return below(to) && strikes(RENAME) ? -1 : real(at, from, there, to, flags);
}
int unlink(const char *path) {
    REAL(unlink);
    if (below(path)) strikes(ANY);
    return real(path);
}
int mkdir(const char *path, mode_t mode) {
    REAL(mkdir);
    if (below(path)) strikes(ANY);
    return real(path, mode);
}
int link(const char *from, const char *to) {
    REAL(link);
    if (below(to)) strikes(ANY);
    return real(from, to);
}
