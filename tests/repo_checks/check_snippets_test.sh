#!/usr/bin/env bash
# scripts/check_snippets accepts pages that show the text of an example, and refuses each change below.
set -euo pipefail
check="$1"
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT

sound_tree() {
  mkdir -p "$tree/examples" "$tree/docs/how-to/deeper"
  printf 'int main() {\n  // snippet-begin: first\n  int a = 1;\n  if (a) {\n    a = 2;\n  }\n  // snippet-end: first\n}\n' \
    > "$tree/examples/one.cpp"
  printf '# Page\n<!-- snippet: examples/one.cpp first -->\n```cpp\nint a = 1;\nif (a) {\n  a = 2;\n}\n```\nEnd.\n' \
    > "$tree/README.md"
  printf 'if True:\n    # snippet-begin: only\n    a = 1\n    # snippet-end: only\n' > "$tree/examples/one.py"
  printf '<!-- snippet: examples/one.py only -->\n```python\na = 1\n```\n' > "$tree/docs/how-to/deeper/python.md"
}

refused() {  # description, sed command, file
  sound_tree
  sed -i "$2" "$tree/$3"
  if "$check" "$tree" > "$tree/said" 2>&1; then
    echo "not refused: $1"
    exit 1
  fi
}

sound_tree
"$check" "$tree"
refused "the page differs" 's/int a = 1/int a = 3/' README.md
refused "the example changed" 's/a = 2;/a = 4;/' examples/one.cpp
refused "the example lost its marks" '/snippet-begin/d' examples/one.cpp
refused "the example lost its end" '/snippet-end/d' examples/one.cpp
refused "a snippet names no example" '/<!-- snippet/d' README.md
refused "a Python snippet in a subfolder differs" 's/a = 1/a = 3/' docs/how-to/deeper/python.md
refused "a Python snippet names no example" '/<!-- snippet/d' docs/how-to/deeper/python.md
refused "a Rust snippet names no example" 's/```cpp/```rust/; /<!-- snippet/d' README.md
refused "a fence with another name for the language" 's/```cpp/```c++/; /<!-- snippet/d' README.md
refused "a snippet names an absent example" 's/one.cpp/two.cpp/' README.md

sound_tree
sed -i 's/a = 2;/a = 4;/' "$tree/examples/one.cpp"
"$check" --write "$tree" > /dev/null
"$check" "$tree" > /dev/null
grep -q '^  a = 4;$' "$tree/README.md"
grep -q '^End\.$' "$tree/README.md"
echo "check_snippets: 10 faults refused, 1 corrected"
