// Something for the flags to harden: an array on the stack, filled by as much as one is given.
#include <cstdio>
#include <cstring>

int main(int count, char** words) {
  char text[64];
  std::strcpy(text, words[count - 1]);
  std::puts(text);
  return 0;
}
