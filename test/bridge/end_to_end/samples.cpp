#include "test/bridge/end_to_end/samples.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include "test/fastcdr.hpp"

namespace trestle::test {
namespace {

// A growing buffer and eProsima's serialiser on it.
class Writer {
 public:
  Writer() { cdr_.serialize_encapsulation(); }

  template <typename T>
  Writer& operator<<(const T& value) {
    cdr_ << value;
    return *this;
  }
  Writer& header(std::uint32_t number, const char* frame) {
    return *this << static_cast<std::int32_t>(1'700'000'000 + number) << std::uint32_t{number * 1000}
                 << std::string{frame};
  }
  [[nodiscard]] Sample finish() {
    const auto sample = std::as_bytes(std::span{memory_}).first(written(cdr_));
    return {sample.begin(), sample.end()};
  }

 private:
  // Cleared, because the serialiser skips over padding without writing it.
  std::vector<char> memory_ = std::vector<char>(std::size_t{8} << 20U);
  eprosima::fastcdr::FastBuffer buffer_{memory_.data(), memory_.size()};
  eprosima::fastcdr::Cdr cdr_{buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, dds_cdr};
};

// Bytes that differ all over, from sample to sample too.
std::vector<std::uint8_t> noise(std::size_t size, std::uint32_t seed) {
  std::vector<std::uint8_t> bytes(size);
  std::uint32_t state = seed * 2654435761U + 1;
  for (std::uint8_t& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24U);
  }
  return bytes;
}

}  // namespace

Sample point_cloud(std::uint32_t number, std::uint32_t points) {
  constexpr std::uint32_t step = 26;
  Writer out;
  out.header(number, "lidar") << std::uint32_t{1} << points;
  struct Field {
    const char* name;
    std::uint32_t offset;
    std::uint8_t datatype;
  };
  const std::vector<Field> fields{{"x", 0, 7},          {"y", 4, 7},     {"z", 8, 7},
                                  {"intensity", 12, 7}, {"ring", 16, 4}, {"time", 18, 8}};
  out << static_cast<std::uint32_t>(fields.size());
  for (const Field& field : fields) {
    out << std::string{field.name} << field.offset << field.datatype << std::uint32_t{1};
  }
  out << false << step << step * points << noise(std::size_t{step} * points, number) << true;
  return out.finish();
}

Sample tf_message(std::uint32_t number) {
  Writer out;
  const std::uint32_t count = number % 5;
  out << count;
  for (std::uint32_t i = 0; i < count; ++i) {
    out.header(number + i, "map") << std::string(i, 'f');
    for (std::uint32_t k = 0; k < 7; ++k) {
      out << std::sqrt(double{0.5} + number + k);
    }
  }
  return out.finish();
}

Sample nav_sat_fix(std::uint32_t number) {
  Writer out;
  out.header(number, "gnss") << std::int8_t{-1} << std::uint16_t{8};
  for (std::uint32_t k = 0; k < 3 + 9; ++k) {
    out << 48.1 + number * 0.001 + k;
  }
  return (out << std::uint8_t{2}).finish();
}

Sample point(std::uint32_t number) {
  Writer out;
  return (out << 1.5 * number << -2.25 << 1e-300).finish();
}

Sample image(std::uint32_t number) {
  constexpr std::uint32_t width = 640;
  constexpr std::uint32_t height = 480;
  Writer out;
  out.header(number, "camera") << height << width << std::string{"rgb8"} << std::uint8_t{0} << 3 * width
                               << noise(std::size_t{3} * width * height, number);
  return out.finish();
}

Sample string(std::uint32_t number) {
  Writer out;
  return (out << std::string("gr\xc3\xbc\xc3\x9f " + std::to_string(number))).finish();
}

Sample floats(std::uint32_t number, std::uint32_t count) {
  Writer out;
  out << std::uint32_t{0} << number << count;  // no dimensions, then the offset of the data
  for (std::uint32_t i = 0; i < count; ++i) {
    out << 0.25F * static_cast<float>(number + i);
  }
  return out.finish();
}

Sample tracks(std::uint32_t number) {
  Writer out;
  out.header(number, "base") << std::uint32_t{2};
  for (std::uint32_t i = 0; i < 2; ++i) {
    out << std::uint64_t{number} * 1000 + i << std::string("car") << 0.5F << 1.5F
        << -2.5F;             // id, label, size
    out << std::uint32_t{3};  // path
    for (std::uint32_t k = 0; k < 3; ++k) {
      out << double{1} + k << double{2} << double{3};
    }
    out << (i == 0) << std::int16_t{-7};
  }
  return out.finish();
}

void write_tracks_package(const char* folder) {
  const std::filesystem::path package = std::filesystem::path{folder} / "test_msgs" / "msg";
  std::filesystem::create_directories(package);
  std::ofstream{package / "Track.msg"} << "uint8 CAR=1\n"
                                          "uint64 id\n"
                                          "string<=16 label  # for people\n"
                                          "float32[3] size\n"
                                          "geometry_msgs/Point[<=8] path\n"
                                          "bool moving true\n"
                                          "int16 confidence -1\n";
  std::ofstream{package / "Tracks.msg"} << "std_msgs/Header header\nTrack[] tracks\n";
}

}  // namespace trestle::test
