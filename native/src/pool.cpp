#include "pool.h"

namespace bearcub {

Pool::Pool(int threads) {
    for (int worker = 1; worker < threads; ++worker) threads_.emplace_back([=] { work(worker); });
}

Pool::~Pool() {
    {
        const std::lock_guard lock(mutex_);
        closing_ = true;
    }
    start_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void Pool::share(const Job& job) {
    next_ = 0;
    if (threads_.empty()) return take_tasks(job, 0);
    {
        const std::lock_guard lock(mutex_);
        job_ = job;
        busy_ = static_cast<int>(threads_.size());
        ++round_;
    }
    start_.notify_all();
    take_tasks(job, 0);
    std::unique_lock lock(mutex_);
    finished_.wait(lock, [this] { return busy_ == 0; });
}

void Pool::take_tasks(const Job& job, int worker) {
    for (int i = next_++; i < job.count; i = next_++) job.call(job.context, i, worker);
}

void Pool::work(int worker) {
    unsigned done = 0;
    while (true) {
        std::unique_lock lock(mutex_);
        start_.wait(lock, [&] { return closing_ || round_ != done; });
        if (closing_) return;
        done = round_;
        const Job job = job_;
        lock.unlock();
        take_tasks(job, worker);
        lock.lock();
        if (--busy_ == 0) finished_.notify_one();
    }
}

}  // namespace bearcub
