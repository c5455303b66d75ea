#pragma once
#include "someip/core/e2e/layout.hpp"

namespace trestle::someip::e2e {

/// Why protect() refused; the bytes and the counter are untouched.
enum class ProtectError : std::uint8_t {
  too_short,        ///< the Data is shorter than min_data_bits (or data_bits)
  too_long,         ///< the Data is longer than max_data_bits (or data_bits)
  header_in_front,  ///< the configured offset lies in `front`, which is not written to
  source_id,        ///< MethodInfo::source_id has more than 28 bits
};
/// The error's name as it stands above, for logs.
[[nodiscard]] const char* to_string(ProtectError error) noexcept;

/// The sending end of one E2E-protected event or method: writes the E2E header and counts the messages.
///
///     auto protector = e2e::Protector::create(e2e::Profile4{.data_id = 0x0100002d});
///     // header: the 16 bytes of the SOME/IP header; payload: 12 bytes left free in front, then the data
///     protector->protect(ByteView{header}.subspan(8), payload);
class Protector {
 public:
  /// Fails naming the field of the profile that cannot be.
  [[nodiscard]] static tl::expected<Protector, ConfigError> create(const Config& config) noexcept;

  /// Protects the Data that is `front` and then `data`, in place: fills in the E2E header, which must lie in
  /// `data`, and leaves everything else alone. Splitting keeps a large payload where it is; a message in one
  /// piece needs no `front`.
  ///
  /// In SOME/IP `front` is the second half of the header, from the Request ID on, which must already say what
  /// will be sent; a message for TP is protected before it is cut.  [feat_req_someip_102]
  tl::expected<void, ProtectError> protect(ByteView front, ByteSpan data,
                                           const MethodInfo& method = {}) noexcept;
  tl::expected<void, ProtectError> protect(ByteSpan data, const MethodInfo& method = {}) noexcept {
    return protect(ByteView{}, data, method);
  }

  /// The counter that the next message will carry.
  [[nodiscard]] std::uint32_t next_counter() const noexcept { return counter_; }
  /// Goes on from elsewhere, say where another process stopped. Counters wrap where the profile's do.
  void resume(std::uint32_t next_counter) noexcept;

 private:
  explicit Protector(const Layout& layout) noexcept : layout_{layout}, counter_{layout.first_counter} {}

  Layout layout_;
  std::uint32_t counter_;
};

}  // namespace trestle::someip::e2e
