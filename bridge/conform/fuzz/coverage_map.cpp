#include "bridge/conform/fuzz/coverage_map.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace trestle::conform {

CoverageMap::CoverageMap(const std::string& file) {
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  void* map = MAP_FAILED;
  if (fd >= 0 && ::ftruncate(fd, size) == 0) {
    map = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  }
  const int error = errno;
  if (fd >= 0) {
    ::close(fd);
  }
  if (map == MAP_FAILED) {
    throw std::runtime_error{"cannot make " + file + ": " + std::strerror(error)};
  }
  map_ = static_cast<std::uint8_t*>(map);
  ::setenv("TRESTLE_COVERAGE", std::filesystem::absolute(file).c_str(), 1);
}

CoverageMap::~CoverageMap() {
  ::munmap(map_, size);
}

bool CoverageMap::grown() {
  bool is_new = false;
  for (std::size_t at = 0; at < size; ++at) {
    if (map_[at] != 0) {
      map_[at] = 0;
      if (!known_[at]) {
        known_[at] = true;
        ++count_;
        is_new = true;
      }
    }
  }
  return is_new;
}

}  // namespace trestle::conform
