// in_namespaces PROGRAM [ARGUMENT ...]: becomes that program, in a network namespace of its own with a cable
// to another one, which TRESTLE_PEER_NAMESPACE names. Where they cannot be made it ends with status 77, as
// skipped; with TRESTLE_REQUIRE_PEERS=1 as failed.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "test/interop/namespaces.hpp"

int main(int argc, char** argv) {
  using trestle::interop::Namespaces;
  if (argc < 2) {
    std::fputs("usage: in_namespaces PROGRAM [ARGUMENT ...]\n", stderr);
    return 2;
  }
  try {
    const Namespaces namespaces;
    setenv("TRESTLE_PEER_NAMESPACE", namespaces.peer_file().c_str(), 1);
    setenv("TMPDIR", Namespaces::folder, 1);
  } catch (const std::runtime_error& error) {
    std::printf("%s: %s\n", Namespaces::required() ? "failed" : "skipped", error.what());
    return Namespaces::required() ? 1 : 77;
  }
  execvp(argv[1], argv + 1);
  std::perror(argv[1]);
  return 1;
}
