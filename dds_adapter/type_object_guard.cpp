#include "dds_adapter/type_object_guard.hpp"
#include "dds_adapter/fastdds_compat.hpp"

#if !TRESTLE_FASTDDS_3
#include <fastrtps/types/DynamicTypePtr.h>
#include <fastrtps/types/TypeObjectFactory.h>

// Fast DDS 2.x builds a description of each type that a peer announces, and dereferences a null pointer when
// the type holds a sequence of structures that it has not seen: one announcement, not authenticated, on any
// topic, ends the process. We have no use for those descriptions. This definition takes the place of the
// library's, because the program's symbols come first in the dynamic linker's search.
namespace eprosima::fastrtps::types {

DynamicType_ptr TypeObjectFactory::build_dynamic_type(const std::string& /*name*/,
                                                      const TypeIdentifier* /*identifier*/,
                                                      const TypeObject* /*object*/) const {
  return DynamicType_ptr{nullptr};
}

}  // namespace eprosima::fastrtps::types
#endif

#ifdef __has_feature
#define TRESTLE_HAS_FEATURE(name) __has_feature(name)
#else
#define TRESTLE_HAS_FEATURE(name) 0
#endif

// What the sanitizers must know of Fast DDS, here because every program that uses it links this file.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
#if defined(__SANITIZE_ADDRESS__) || TRESTLE_HAS_FEATURE(address_sanitizer)
extern "C" const char* __asan_default_options();
/// It deletes its writers through a base class of another size.
extern "C" const char* __asan_default_options() {
  return "new_delete_type_mismatch=0";
}
#endif
#if defined(__SANITIZE_THREAD__) || TRESTLE_HAS_FEATURE(thread_sanitizer)
extern "C" const char* __tsan_default_suppressions();
/// It is not instrumented, so its own locks are not seen.
extern "C" const char* __tsan_default_suppressions() {
  return "called_from_lib:libfastrtps.so\n";
}
#endif
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace trestle::dds::detail {

void link_type_object_guard() noexcept {}

}  // namespace trestle::dds::detail
