/* Loaded before libc (LD_PRELOAD): records what of a folder has been synchronised, and ends the process at a
 * chosen operation, as a loss of power would.
 *
 * ROOT      the folder that is watched
 * RECORD    a folder on the same file system, with the folders files, folders and removed in it
 * CRASH_AT  number of the operation (fsync, rename, unlink, rmdir) before or after which the process ends
 *
 * After fsync of a file its bytes are copied to RECORD/files/<inode>, after fsync of a folder its names with their
 * inodes to RECORD/folders/<inode>. What is removed or replaced goes to RECORD/removed/<inode> instead, so that no
 * inode is used twice and what a lost removal brings back is still there.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef char path_t[PATH_MAX];

static atomic_long operations;

long count_of_operations(void) {
    return atomic_load(&operations);
}

static void step(void) {
    const char *at = getenv("CRASH_AT");
    if (at && atomic_fetch_add(&operations, 1) + 1 == atol(at)) {
        kill(getpid(), SIGKILL);
        pause();
    }
}

static int is_watched(const char *path) {
    const char *root = getenv("ROOT");
    size_t length = root ? strlen(root) : 0;
    return root && !strncmp(path, root, length) && (path[length] == '/' || !path[length]);
}

static int path_of(int handle, path_t path) {
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    ssize_t length = readlink(link, path, PATH_MAX - 1);
    if (length < 0) return 0;
    path[length] = 0;
    return 1;
}

/* the absolute path of a name given relative to a folder, or to the working directory */
static int resolve(int folder, const char *name, path_t path) {
    path_t base;
    if (name[0] == '/') return snprintf(path, PATH_MAX, "%s", name) < PATH_MAX;
    if (folder == AT_FDCWD ? !getcwd(base, PATH_MAX) : !path_of(folder, base)) return 0;
    return snprintf(path, PATH_MAX, "%s/%s", base, name) < PATH_MAX;
}

static void recorded(const char *kind, ino_t inode, path_t path) {
    snprintf(path, PATH_MAX, "%s/%s/%lu", getenv("RECORD"), kind, (unsigned long)inode);
}

static void copy(const char *from, const char *to) {
    char buffer[1 << 16];
    int in = open(from, O_RDONLY), out = open(to, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (in < 0 || out < 0) abort();
    for (ssize_t n; (n = read(in, buffer, sizeof buffer)) > 0;)
        if (write(out, buffer, n) != n) abort();
    close(in);
    close(out);
}

static void note_names(const char *from, const char *to) {
    DIR *folder = opendir(from);
    FILE *out = fopen(to, "w");
    if (!folder || !out) abort();
    for (struct dirent *entry; (entry = readdir(folder));)
        if (strcmp(entry->d_name, ".") && strcmp(entry->d_name, ".."))
            fprintf(out, "%lu %s\n", (unsigned long)entry->d_ino, entry->d_name);
    fclose(out);
    closedir(folder);
}

static int synchronise(int handle, int (*real)(int)) {
    path_t path, note;
    struct stat found;
    if (!path_of(handle, path) || !is_watched(path) || fstat(handle, &found)) return real(handle);
    step();
    int status = real(handle);
    if (!status) {
        int folder = S_ISDIR(found.st_mode);
        recorded(folder ? "folders" : "files", found.st_ino, note);
        (folder ? note_names : copy)(path, note);
    }
    step();
    return status;
}

int fsync(int handle) {
    return synchronise(handle, (int (*)(int))dlsym(RTLD_NEXT, "fsync"));
}

int fdatasync(int handle) {
    return synchronise(handle, (int (*)(int))dlsym(RTLD_NEXT, "fdatasync"));
}

int renameat(int from_folder, const char *from, int to_folder, const char *to) {
    int (*real)(int, const char *, int, const char *) = dlsym(RTLD_NEXT, "renameat");
    path_t path, kept;
    struct stat found;
    if (!resolve(to_folder, to, path) || !is_watched(path)) return real(from_folder, from, to_folder, to);
    step();
    if (!lstat(path, &found) && !S_ISDIR(found.st_mode)) {
        recorded("removed", found.st_ino, kept);
        if (link(path, kept)) abort();
    }
    int status = real(from_folder, from, to_folder, to);
    step();
    return status;
}

int rename(const char *from, const char *to) {
    return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

int unlinkat(int folder, const char *name, int flags) {
    int (*real)(int, const char *, int) = dlsym(RTLD_NEXT, "unlinkat");
    int (*move)(int, const char *, int, const char *) = dlsym(RTLD_NEXT, "renameat");
    path_t path, kept;
    struct stat found;
    if (!resolve(folder, name, path) || !is_watched(path) || lstat(path, &found)) return real(folder, name, flags);
    if (!!(flags & AT_REMOVEDIR) != !!S_ISDIR(found.st_mode)) return real(folder, name, flags);
    if (S_ISDIR(found.st_mode)) {
        DIR *inside = opendir(path);
        int entries = 0;
        while (inside && readdir(inside)) entries++;
        if (inside) closedir(inside);
        if (entries > 2) return real(folder, name, flags); /* which says that it is not empty */
    }
    step();
    recorded("removed", found.st_ino, kept);
    int status = move(AT_FDCWD, path, AT_FDCWD, kept);
    step();
    return status;
}

int unlink(const char *name) {
    return unlinkat(AT_FDCWD, name, 0);
}

int rmdir(const char *name) {
    return unlinkat(AT_FDCWD, name, AT_REMOVEDIR);
}
