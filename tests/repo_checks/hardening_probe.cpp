// A program with something to harden: a stack buffer filled from an argument of any length.
#include <cstdio>
#include <cstring>

int main(int count, char** words) {
  char text[64];
  std::strcpy(text, words[count - 1]);
  std::puts(text);
  return 0;
}
