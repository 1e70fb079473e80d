// The interpreter's lock. A thread that requests it while the interpreter is ending does not get
// it: CPython up to 3.13 then ends the thread by pthread_exit, which must not unwind C++ frames,
// and the process aborts. Here such a thread blocks for ever, as CPython 3.14 does, and ends with
// the process. So only this file releases and takes the lock.
#pragma once

#include <Python.h>

namespace throng::python {

// The interpreter is ending: only the thread that ends it gets the lock. That thread holds it.
inline bool is_ending() noexcept { return !Py_IsInitialized(); }

// Releases the lock, held by this thread, for its lifetime.
class Unlocked {
 public:
  Unlocked() noexcept;
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  bool by_finalizing_thread_;
  PyThreadState* state_;
};

// Holds the lock for its lifetime, on any thread.
class Locked {
 public:
  Locked() noexcept;
  ~Locked();
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  PyGILState_STATE state_;
};

// function(argument), and whether a value is true, by Python's rules: Python code in there may
// release the lock. Results and errors as for PyObject_Call and PyObject_IsTrue.
PyObject* call_one(PyObject* function, PyObject* argument) noexcept;
int is_true(PyObject* value) noexcept;

}  // namespace throng::python
