// Threads that stay, and share out numbered tasks.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace bearcub {

class Pool {
public:
    // The thread that calls `run` is one of `threads`.
    explicit Pool(int threads);
    ~Pool();
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;

    int threads() const { return static_cast<int>(threads_.size()) + 1; }

    // Call task(i, worker) for every i below `count`; return when all are done. Tasks must not
    // throw. Who does which task is open; the worker says whose scratch memory to use.
    template <class Task>
    void run(int count, Task& task) {
        share({[](void* context, int i, int worker) { (*static_cast<Task*>(context))(i, worker); },
               &task, count});
    }

private:
    struct Job {
        void (*call)(void*, int, int);
        void* context;
        int count;
    };

    void share(const Job& job);
    void work(int worker);
    void take_tasks(const Job& job, int worker);

    std::mutex mutex_;
    std::condition_variable start_, finished_;
    Job job_{nullptr, nullptr, 0};
    unsigned round_ = 0;  // counts jobs, so that a worker knows a new one
    int busy_ = 0;
    bool closing_ = false;
    std::atomic<int> next_{0};
    std::vector<std::thread> threads_;
};

}  // namespace bearcub
