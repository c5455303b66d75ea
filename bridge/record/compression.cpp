#include "bridge/record/compression.hpp"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <array>
#include <cstring>

namespace trestle::record {
namespace {

constexpr int fastest_zstd = 1;

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const noexcept { LZ4F_freeDecompressionContext(context); }
};

std::string decompress_lz4(ByteView bytes, ByteSpan room) {
  LZ4F_dctx* made = nullptr;
  if (const auto status = LZ4F_createDecompressionContext(&made, LZ4F_VERSION); LZ4F_isError(status) != 0) {
    return LZ4F_getErrorName(status);
  }
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context{made};
  std::size_t read = 0;
  std::size_t written = 0;
  // Of what is left to read when a frame is over there may be another one.
  for (;;) {
    std::size_t in = bytes.size() - read;
    std::size_t out = room.size() - written;
    const std::size_t status =
        LZ4F_decompress(context.get(), room.data() + written, &out, bytes.data() + read, &in, nullptr);
    if (LZ4F_isError(status) != 0) {
      return LZ4F_getErrorName(status);
    }
    read += in;
    written += out;
    if (status == 0 && read == bytes.size()) {
      break;
    }
    if (in == 0 && out == 0) {
      return read == bytes.size() ? "the bytes end within a frame" : "it holds more than it should";
    }
  }
  return written == room.size() ? "" : fmt::format("it holds {} bytes", written);
}

std::string decompress_zstd(ByteView bytes, ByteSpan room) {
  const std::size_t written = ZSTD_decompress(room.data(), room.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(written) != 0) {
    return ZSTD_getErrorName(written);
  }
  return written == room.size() ? "" : fmt::format("it holds {} bytes", written);
}

}  // namespace

const char* to_string(Compression compression) noexcept {
  constexpr std::array<const char*, 3> names{"none", "lz4", "zstd"};
  return names[static_cast<std::size_t>(compression)];
}

std::string_view in_file(Compression compression) noexcept {
  return compression == Compression::none ? std::string_view{} : to_string(compression);
}

std::optional<Compression> compression_in_file(std::string_view name) noexcept {
  for (const Compression one : {Compression::none, Compression::lz4, Compression::zstd}) {
    if (name == in_file(one)) {
      return one;
    }
  }
  return std::nullopt;
}

struct Compressor::State {
  Compression compression = Compression::none;
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> zstd{nullptr, ZSTD_freeCCtx};
};

Compressor::Compressor(Compression compression) : state_{std::make_unique<State>()} {
  state_->compression = compression;
  if (compression == Compression::zstd) {
    state_->zstd.reset(ZSTD_createCCtx());
  }
}

Compressor::Compressor(Compressor&&) noexcept = default;
Compressor& Compressor::operator=(Compressor&&) noexcept = default;
Compressor::~Compressor() = default;

bool Compressor::add(ByteView bytes, std::vector<std::byte>& out) {
  if (state_->compression == Compression::none) {
    return false;
  }
  const std::size_t before = out.size();
  std::size_t made = 0;
  bool failed = false;
  if (state_->compression == Compression::lz4) {
    out.resize(before + LZ4F_compressFrameBound(bytes.size(), nullptr));
    made = LZ4F_compressFrame(out.data() + before, out.size() - before, bytes.data(), bytes.size(), nullptr);
    failed = LZ4F_isError(made) != 0;
  } else {
    out.resize(before + ZSTD_compressBound(bytes.size()));
    made = ZSTD_compressCCtx(state_->zstd.get(), out.data() + before, out.size() - before, bytes.data(),
                             bytes.size(), fastest_zstd);
    failed = ZSTD_isError(made) != 0;
  }
  const bool good = !failed && made < bytes.size();
  out.resize(before + (good ? made : 0));
  return good;
}

std::string decompress(Compression compression, ByteView bytes, ByteSpan room) {
  switch (compression) {
    case Compression::lz4:
      return decompress_lz4(bytes, room);
    case Compression::zstd:
      return decompress_zstd(bytes, room);
    case Compression::none:
      break;
  }
  if (bytes.size() != room.size()) {
    return fmt::format("it holds {} bytes", bytes.size());
  }
  if (!bytes.empty()) {
    std::memcpy(room.data(), bytes.data(), bytes.size());
  }
  return {};
}

}  // namespace trestle::record
