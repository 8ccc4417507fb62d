// SPDX-License-Identifier: MIT
#pragma once

#include "conversions.h"

#include <atomic>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace terrane::python {

/// Holds an object that any number of threads may read at once, or that one thread may change, and that close()
/// destroys. A use that conflicts with another thread's raises a RuntimeError instead of being a data race; use after
/// close() raises a ValueError, as for a closed file.
///
/// Cost: a few atomic operations per use
template <class T>
class Guarded {
public:
    /// @param name of the Python class, for messages
    Guarded(const char* name, T object) : name_(name), object_(std::move(object)) {}
    Guarded(const Guarded&) = delete;
    Guarded& operator=(const Guarded&) = delete;
    /// Waits for the object's threads without the interpreter lock.
    ~Guarded() { destroy(); }

    /// Access to the object during a call.
    class Use {
    public:
        Use(Guarded& owner, bool is_exclusive) : owner_(owner), is_exclusive_(is_exclusive) {
            owner_.enter(is_exclusive);
        }
        Use(const Use&) = delete;
        Use& operator=(const Use&) = delete;
        ~Use() { owner_.leave(is_exclusive_); }
        T& operator*() const { return *owner_.object_; }
        T* operator->() const { return &*owner_.object_; }

    private:
        Guarded& owner_;
        bool is_exclusive_;
    };

    /// Exclusive access, for calls that change the object.
    Use change() { return Use(*this, true); }
    /// Shared access, for calls that may run concurrently with each other.
    Use read() { return Use(*this, false); }

    bool is_closed() const { return !object_.has_value(); }

    /// Destroys the object; no effect if it is closed.
    void close() {
        if (is_closed()) return;
        const Use use(*this, true);
        destroy();
    }

private:
    static constexpr int kExclusive = -1;

    void enter(bool is_exclusive) {
        int seen = users_.load();
        do {
            if (seen == kExclusive || (is_exclusive && seen != 0))
                throw std::runtime_error(std::string("this ") + name_ +
                                         " is in use by another thread");
        } while (!users_.compare_exchange_weak(seen, is_exclusive ? kExclusive : seen + 1));
        if (object_.has_value()) return;
        leave(is_exclusive);
        throw py::value_error(std::string("this ") + name_ + " is closed");
    }

    void leave(bool is_exclusive) {
        if (is_exclusive) {
            users_.store(0);
        } else {
            users_.fetch_sub(1);
        }
    }

    void destroy() {
        if (!object_.has_value()) return;
        if (PyGILState_Check() != 0) {
            const py::gil_scoped_release released;
            object_.reset();
        } else {
            object_.reset();
        }
    }

    const char* name_;
    std::atomic<int> users_{0};  // number of readers, or kExclusive
    std::optional<T> object_;
};

}  // namespace terrane::python
