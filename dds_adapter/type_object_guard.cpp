#include <fastrtps/types/DynamicTypePtr.h>
#include <fastrtps/types/TypeObjectFactory.h>

#include "dds_adapter/fastdds_compat.hpp"

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

namespace trestle::dds::fast {

void link_type_object_guard() noexcept {}

}  // namespace trestle::dds::fast
