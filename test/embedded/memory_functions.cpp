// All that the core wants of a C library: what GCC itself calls to copy, set and compare. Here as small as
// can be; a program has those of its C library.
#include <cstddef>

extern "C" {

void* memcpy(void* to, const void* from, std::size_t bytes);
void* memmove(void* to, const void* from, std::size_t bytes);
void* memset(void* to, int value, std::size_t bytes);
int memcmp(const void* a, const void* b, std::size_t bytes);
std::size_t strlen(const char* text);
void* memchr(void* bytes, int value, std::size_t count);

void* memcpy(void* to, const void* from, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    static_cast<char*>(to)[i] = static_cast<const char*>(from)[i];
  }
  return to;
}

void* memmove(void* to, const void* from, std::size_t bytes) {
  if (to <= from) {
    return memcpy(to, from, bytes);
  }
  while (bytes-- > 0) {
    static_cast<char*>(to)[bytes] = static_cast<const char*>(from)[bytes];
  }
  return to;
}

void* memset(void* to, int value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    static_cast<char*>(to)[i] = static_cast<char>(value);
  }
  return to;
}

int memcmp(const void* a, const void* b, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) {
    const int difference = static_cast<const unsigned char*>(a)[i] - static_cast<const unsigned char*>(b)[i];
    if (difference != 0) {
      return difference;
    }
  }
  return 0;
}

std::size_t strlen(const char* text) {
  std::size_t length = 0;
  while (text[length] != '\0') {
    ++length;
  }
  return length;
}

void* memchr(void* bytes, int value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (static_cast<unsigned char*>(bytes)[i] == static_cast<unsigned char>(value)) {
      return static_cast<unsigned char*>(bytes) + i;
    }
  }
  return nullptr;
}

}  // extern "C"
