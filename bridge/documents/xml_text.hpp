#pragma once
#include <string>
#include <string_view>

namespace trestle::documents {

/// Text of an element or attribute of XML and HTML: "&" as "&amp;" and so on. A control character that XML
/// cannot have becomes '?'.
[[nodiscard]] std::string xml_text(std::string_view text);

}  // namespace trestle::documents
