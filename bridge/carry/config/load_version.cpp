#include "bridge/carry/config/load_version.hpp"

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/documents/section.hpp"

namespace trestle::carry {

void load_version(documents::Section& section, bool asked_for, std::uint8_t& major, std::uint32_t& minor) {
  // 0xff is "any major version", which nothing here can have: conversion depends on it.
  section.read("major", documents::as<std::uint8_t>(documents::whole_number(0, 254)), major);
  auto format = documents::as<std::uint32_t>(documents::whole_number(0, any_minor - 1));
  if (asked_for) {
    minor = any_minor;
    format.expected += ", or any";
    format.read = [number = std::move(format.read)](std::string_view text) {
      return text == "any" ? std::optional{any_minor} : number(text);
    };
  }
  section.read("minor", format, minor);
}

}  // namespace trestle::carry
