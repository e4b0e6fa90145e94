/* One call of each family, named by the argument: says how much time has passed by the clock that it sees, and what came of it. */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/futex.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static int ends[2];
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t cond = PTHREAD_COND_INITIALIZER;
static sem_t semaphore;
static uint32_t word;

static int64_t now(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}
static struct timespec at(clockid_t clock, int64_t ms) {
    int64_t ns = now(clock) + ms * 1000000;
    return (struct timespec){ns / 1000000000, ns % 1000000000};
}
/* After three seconds. */
static void *later(void *what) {
    struct timespec three = {3, 0};
    nanosleep(&three, NULL);
    if (!strcmp(what, "byte")) write(ends[1], "x", 1);
    if (!strcmp(what, "cond")) pthread_mutex_lock(&mutex), pthread_cond_broadcast(&cond), pthread_mutex_unlock(&mutex);
    if (!strcmp(what, "sem")) sem_post(&semaphore);
    if (!strcmp(what, "word")) word = 1, syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, NULL, NULL, 0);
    return NULL;
}
static long result(long got) { return got < 0 ? -errno : got; }

int main(int argc, char **argv) {
    const char *name = argv[1], *help = argc > 2 ? argv[2] : "";
    struct timespec ten = {10, 0};
    struct timeval ten_tv = {10, 0};
    pthread_t thread;
    uint64_t count = 0;
    char byte;
    long got = 0;
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) return 1;
    sem_init(&semaphore, 0, 0);
    if (*help) pthread_create(&thread, NULL, later, (void *)help);
    int64_t begun = now(CLOCK_MONOTONIC), cpu = now(CLOCK_PROCESS_CPUTIME_ID);
    struct pollfd fd = {ends[0], POLLIN, 0};
    if (!strcmp(name, "nanosleep")) got = result(nanosleep(&ten, NULL));
    if (!strcmp(name, "clock_nanosleep")) {
        struct timespec then = at(CLOCK_REALTIME, 10000);
        got = clock_nanosleep(CLOCK_REALTIME, TIMER_ABSTIME, &then, NULL);
    }
    if (!strcmp(name, "sleep")) got = sleep(10);
    if (!strcmp(name, "usleep")) got = usleep(10000000);
    if (!strcmp(name, "poll")) got = result(poll(&fd, 1, 10000));
    if (!strcmp(name, "poll_many")) {
        static struct pollfd many[100];
        for (int i = 0; i < 100; i++) many[i] = fd;
        got = result(poll(many, 100, 10000));
    }
    if (!strcmp(name, "ppoll")) got = result(ppoll(&fd, 1, &ten, NULL));
    if (!strcmp(name, "select")) {
        fd_set set;
        FD_ZERO(&set);
        FD_SET(ends[0], &set);
        got = result(select(ends[0] + 1, &set, NULL, NULL, &ten_tv)) * 10 + FD_ISSET(ends[0], &set);
    }
    if (!strcmp(name, "pselect")) got = result(pselect(0, NULL, NULL, NULL, &ten, NULL));
    if (!strncmp(name, "epoll", 5)) {
        struct epoll_event event = {EPOLLIN, {0}};
        int epoll = epoll_create1(0);
        epoll_ctl(epoll, EPOLL_CTL_ADD, ends[0], &event);
        if (!strcmp(name, "epoll_wait")) got = result(epoll_wait(epoll, &event, 1, 10000));
        if (!strcmp(name, "epoll_pwait")) got = result(epoll_pwait(epoll, &event, 1, 10000, NULL));
        if (!strcmp(name, "epoll_pwait2")) got = result(epoll_pwait2(epoll, &event, 1, &ten, NULL));
    }
    if (!strncmp(name, "timerfd", 7)) {
        int timer = timerfd_create(CLOCK_MONOTONIC, 0);
        struct itimerspec every = {{0, 0}, {10, 0}}, left;
        if (!strcmp(name, "timerfd_interval")) every = (struct itimerspec){{4, 0}, {2, 0}};
        timerfd_settime(timer, 0, &every, NULL);
        timerfd_gettime(timer, &left);
        if (left.it_value.tv_sec != every.it_value.tv_sec) return 2;
        struct pollfd ready = {timer, POLLIN, 0};
        if (poll(&ready, 1, 60000) != 1) return 3;
        if (!strcmp(name, "timerfd_interval")) sleep(8); /* at 2, 6 and 10 s */
        if (read(timer, &count, 8) != 8) return 4;
        got = count;
        close(timer);
    }
    if (!strncmp(name, "cond", 4)) {
        struct timespec then = at(CLOCK_REALTIME, 10000), monotonic = at(CLOCK_MONOTONIC, 10000);
        pthread_mutex_lock(&mutex);
        if (!strcmp(name, "cond_timedwait")) got = pthread_cond_timedwait(&cond, &mutex, &then);
        if (!strcmp(name, "cond_clockwait")) got = pthread_cond_clockwait(&cond, &mutex, CLOCK_MONOTONIC, &monotonic);
        if (!strcmp(name, "cond_monotonic")) {
            pthread_condattr_t attributes;
            pthread_condattr_init(&attributes);
            pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
            pthread_cond_init(&cond, &attributes);
            got = pthread_cond_timedwait(&cond, &mutex, &monotonic);
        }
        pthread_mutex_unlock(&mutex);
    }
    if (!strncmp(name, "sem", 3)) {
        struct timespec then = at(CLOCK_REALTIME, 10000), monotonic = at(CLOCK_MONOTONIC, 10000);
        if (!strcmp(name, "sem_timedwait")) got = result(sem_timedwait(&semaphore, &then));
        if (!strcmp(name, "sem_clockwait")) got = result(sem_clockwait(&semaphore, CLOCK_MONOTONIC, &monotonic));
    }
    if (!strcmp(name, "mutex_timedlock")) {
        struct timespec then = at(CLOCK_REALTIME, 10000);
        pthread_mutex_lock(&mutex);
        got = pthread_mutex_timedlock(&mutex, &then);
    }
    if (!strcmp(name, "futex")) got = result(syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, 0, &ten, NULL, 0));
    if (!strcmp(name, "futex_bitset")) {
        struct timespec then = at(CLOCK_MONOTONIC, 10000);
        got = result(syscall(SYS_futex, &word, FUTEX_WAIT_BITSET_PRIVATE, 0, &then, NULL, -1));
    }
    if (!strncmp(name, "rcvtimeo", 8)) {
        struct timeval kept = {0, 0};
        socklen_t size = sizeof kept;
        if (setsockopt(ends[0], SOL_SOCKET, SO_RCVTIMEO, &ten_tv, sizeof ten_tv)) return 5;
        if (getsockopt(ends[0], SOL_SOCKET, SO_RCVTIMEO, &kept, &size) || kept.tv_sec != 10) return 6;
        if (!strcmp(name, "rcvtimeo_recv")) got = result(recv(ends[0], &byte, 1, 0));
        if (!strcmp(name, "rcvtimeo_read")) got = result(read(ends[0], &byte, 1));
        if (!strcmp(name, "rcvtimeo_recvmsg")) {
            struct iovec part = {&byte, 1};
            struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
            got = result(recvmsg(ends[0], &message, 0));
        }
    }
    if (!strcmp(name, "fork")) {
        int status = 0;
        pid_t child = fork();
        if (child == 0) _exit(poll(&fd, 1, 10000) == 0 && sleep(1) == 0 ? 7 : 8);
        waitpid(child, &status, 0);
        got = WEXITSTATUS(status);
    }
    if (!strcmp(name, "clocks")) {
        struct timeval tv;
        got = -1;
        for (int look = 0; look < 3 && got < 0; look++) { /* a second may end between two looks at the host's clocks */
            if (look) usleep(20000);
            gettimeofday(&tv, NULL);
            if (tv.tv_sec == time(NULL) && tv.tv_sec == now(CLOCK_REALTIME) / 1000000000) got = tv.tv_sec;
        }
        volatile unsigned work = 0;
        while (now(CLOCK_PROCESS_CPUTIME_ID) == cpu) work++; /* the processor's time goes on */
    }
    printf("%s %lld ms %ld\n", name, (long long)(now(CLOCK_MONOTONIC) - begun) / 1000000, got);
    if (*help) pthread_join(thread, NULL);
    return 0;
}
