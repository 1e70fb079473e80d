// The target that owns the tests' precompiled headers.
int main() {}
