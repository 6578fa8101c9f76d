/* A preloaded library that makes one call to the disk fail: the k-th write, fsync, rename, open for writing or mkdir
   below a folder. `faulty_disk.py` builds and drives it.

   What libc calls inside itself does not pass here: fwrite of a FILE, for one. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { OPEN, WRITE, FSYNC, RENAME, MKDIR, KINDS };
enum { DIES = -1 };
static char folder[4096];
static size_t length;
static long fails_at;
static int with, for_good;
static atomic_long calls, seen[KINDS];
static _Atomic char below[65536];

/* Fails call `k` (0: none) below `place` with `error`, or kills the process (DIES); `stays`: all calls from then on. */
void faults_arm(const char *place, long k, int error, int stays) {
    length = strlen(place);
    memcpy(folder, place, length + 1);
    fails_at = k, with = error, for_good = stays;
    atomic_store(&calls, 0);
    for (int kind = 0; kind < KINDS; kind++) atomic_store(&seen[kind], 0);
}

/* How many calls of a kind there were. */
long faults_seen(int kind) { return atomic_load(&seen[kind]); }

static int is_below(const char *path) {
    return length && strncmp(path, folder, length) == 0 && (path[length] == '/' || path[length] == '\0');
}

static int fails(int kind) {
    atomic_fetch_add(&seen[kind], 1);
    long number = atomic_fetch_add(&calls, 1) + 1;
    if (!fails_at || number < fails_at || (number > fails_at && !for_good)) return 0;
    if (with == DIES) kill(getpid(), SIGKILL);
    errno = with;
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

static int writes(int flags) { return (flags & O_ACCMODE) != O_RDONLY || (flags & O_CREAT); }
static int noted(int file, int is_ours) {
    if (file >= 0 && file < (int)sizeof below) below[file] = (char)is_ours;
    return file;
}
static int ours(int file) { return file >= 0 && file < (int)sizeof below && below[file]; }

#define MODE(flags, mode) \
    mode_t mode = 0; \
    if ((flags) & (O_CREAT | __O_TMPFILE)) { va_list rest; va_start(rest, flags); mode = va_arg(rest, mode_t); va_end(rest); }
#define OPENING(name) \
    int name(const char *path, int flags, ...) { \
        MODE(flags, mode) \
        int hit = is_below(path) && writes(flags); \
        return hit && fails(OPEN) ? -1 : noted(REAL(name)(path, flags, mode), hit); \
    }
#define OPENING_AT(name) \
    int name(int at, const char *path, int flags, ...) { \
        MODE(flags, mode) \
        int hit = is_below(path) && writes(flags); \
        return hit && fails(OPEN) ? -1 : noted(REAL(name)(at, path, flags, mode), hit); \
    }
OPENING(open)
OPENING(open64)
OPENING_AT(openat)
OPENING_AT(openat64)

int close(int file) { noted(file, 0); return REAL(close)(file); }
ssize_t write(int file, const void *data, size_t size) {
    return ours(file) && fails(WRITE) ? -1 : REAL(write)(file, data, size);
}
ssize_t pwrite(int file, const void *data, size_t size, off_t at) {
    return ours(file) && fails(WRITE) ? -1 : REAL(pwrite)(file, data, size, at);
}
ssize_t pwrite64(int file, const void *data, size_t size, off64_t at) {
    return ours(file) && fails(WRITE) ? -1 : REAL(pwrite64)(file, data, size, at);
}
ssize_t writev(int file, const struct iovec *parts, int count) {
    return ours(file) && fails(WRITE) ? -1 : REAL(writev)(file, parts, count);
}
int fsync(int file) { return ours(file) && fails(FSYNC) ? -1 : REAL(fsync)(file); }
int fdatasync(int file) { return ours(file) && fails(FSYNC) ? -1 : REAL(fdatasync)(file); }
int rename(const char *from, const char *to) { return is_below(to) && fails(RENAME) ? -1 : REAL(rename)(from, to); }
int renameat(int at, const char *from, int there, const char *to) {
    return is_below(to) && fails(RENAME) ? -1 : REAL(renameat)(at, from, there, to);
}
int mkdir(const char *path, mode_t mode) { return is_below(path) && fails(MKDIR) ? -1 : REAL(mkdir)(path, mode); }
int mkdirat(int at, const char *path, mode_t mode) {
    return is_below(path) && fails(MKDIR) ? -1 : REAL(mkdirat)(at, path, mode);
}
