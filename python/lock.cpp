// Compiled without exceptions, so that pthread_cleanup_push does not use this module's unwinder:
// the module links its own C++ library and unwinder, and pthread_exit uses another. The functions
// here have no destructors to run.
#include "python/lock.hpp"

#if defined(_WIN32)
#include <windows.h>
#else
#include <pthread.h>
#include <unistd.h>
#endif

namespace throng::python {
namespace {

[[noreturn]] void block_for_ever() noexcept {
  for (;;) {
#if defined(_WIN32)
    Sleep(INFINITE);
#else
    pause();
#endif
  }
}

// f(), which waits for the lock or runs Python; the thread does not end inside.
template <class F>
void stay(const F& f) noexcept {
#if defined(_WIN32)
  f();
#else
  pthread_cleanup_push([](void*) { block_for_ever(); }, nullptr);
  f();
  pthread_cleanup_pop(0);
#endif
}

}  // namespace

Unlocked::Unlocked() noexcept : by_finalizing_thread_(is_ending()), state_(PyEval_SaveThread()) {}

Unlocked::~Unlocked() {
  if (is_ending() && !by_finalizing_thread_) block_for_ever();
  stay([this] { PyEval_RestoreThread(state_); });
}

Locked::Locked() noexcept {
  if (is_ending()) block_for_ever();
  stay([this] { state_ = PyGILState_Ensure(); });
}

Locked::~Locked() { PyGILState_Release(state_); }

PyObject* call_one(PyObject* function, PyObject* argument) noexcept {
  struct Call {
    PyObject *function, *argument, *answer;
  } one{function, argument, nullptr};
  stay([&one] { one.answer = PyObject_CallFunctionObjArgs(one.function, one.argument, nullptr); });
  return one.answer;
}

int is_true(PyObject* value) noexcept {
  struct Truth {
    PyObject* value;
    int is;
  } one{value, -1};
  stay([&one] { one.is = PyObject_IsTrue(one.value); });
  return one.is;
}

}  // namespace throng::python
