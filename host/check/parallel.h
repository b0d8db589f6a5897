#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace clarus::check {

/// Calls work(i) for all i < count, on as many threads as there are processors. Errors: the first that `work` threw.
template <typename Work>
void for_each_index(size_t count, const Work& work) {
    std::atomic<size_t> next = 0;
    std::exception_ptr error;
    std::mutex mutex;
    const auto run = [&] {
        for (size_t i = next++; i < count; i = next++) try {
                work(i);
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (!error) error = std::current_exception();
            }
    };
    {
        std::vector<std::jthread> threads;
        const size_t most = std::max(1u, std::thread::hardware_concurrency());
        for (size_t i = 1; i < std::min(count, most); ++i) threads.emplace_back(run);
        run();
    }
    if (error) std::rethrow_exception(error);
}

}  // namespace clarus::check
