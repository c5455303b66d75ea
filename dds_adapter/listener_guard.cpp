#include <fastdds/rtps/reader/RTPSReader.h>
#include <fastdds/rtps/reader/ReaderListener.h>

#include <mutex>

#include "dds_adapter/fastdds_compat.hpp"

// While Fast DDS 2.x tells a reader of a writer that has come or left, it asks the reader for its listener
// three times, and uses the last answer without a look at it. A reader that is deleted at that moment has
// none any more: the process ends. Deleting one takes its listener off first, and then waits until nobody
// tells it anything. So it gets one that does nothing. This definition replaces the library's, as in
// type_object_guard.cpp.
namespace eprosima::fastrtps::rtps {

bool RTPSReader::setListener(ReaderListener* target) {
  static ReaderListener nobody;
  const std::lock_guard lock{mp_mutex};
  mp_listener = target == nullptr ? &nobody : target;
  return true;
}

}  // namespace eprosima::fastrtps::rtps

namespace trestle::dds::fast {

void link_listener_guard() noexcept {}

}  // namespace trestle::dds::fast
