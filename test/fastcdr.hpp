/// eProsima's serialiser for tests, by the names that Fast CDR 1 (Debian 12) and 2 (Debian 13) have in common
/// here.
#pragma once

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <cstddef>

namespace trestle::test {

#if __has_include(<fastcdr/CdrEncoding.hpp>)
inline constexpr auto dds_cdr = eprosima::fastcdr::CdrVersion::DDS_CDR;
inline std::size_t written(const eprosima::fastcdr::Cdr& cdr) {
  return cdr.get_serialized_data_length();
}
#else
inline constexpr auto dds_cdr = eprosima::fastcdr::Cdr::DDS_CDR;
/// How many bytes it has written, with those of the encapsulation.
inline std::size_t written(const eprosima::fastcdr::Cdr& cdr) {
  return cdr.getSerializedDataLength();
}
#endif

}  // namespace trestle::test
