// The interpreter's lock. Who comes back to it when the interpreter is ending does not get it:
// CPython up to 3.13 then ends the thread by pthread_exit, whose unwinding meets C++ functions that
// may not be left so, and the process aborts. Here such a thread sleeps for ever, as CPython 3.14
// lets it, and ends with the process. So no other file of the module lets go of the lock, or takes
// it.
#pragma once

#include <Python.h>

namespace throng::python {

// The interpreter is ending: none but the thread that ends it gets the lock. That thread has it.
inline bool is_ending() noexcept { return !Py_IsInitialized(); }

// Lets go of the lock, which this thread has, as long as this lives.
class Unlocked {
 public:
  Unlocked() noexcept;
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  bool by_who_ends_it_;
  PyThreadState* state_;
};

// Has the lock as long as this lives, on any thread.
class Locked {
 public:
  Locked() noexcept;
  ~Locked();
  Locked(const Locked&) = delete;
  Locked& operator=(const Locked&) = delete;

 private:
  PyGILState_STATE state_;
};

// function(argument), and whether a value is true, by Python's rules: what Python runs in there
// lets others have the lock now and then. They answer and raise as PyObject_Call and
// PyObject_IsTrue do.
PyObject* call_one(PyObject* function, PyObject* argument) noexcept;
int is_true(PyObject* value) noexcept;

}  // namespace throng::python
