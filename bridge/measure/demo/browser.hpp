#pragma once
#include <string>

namespace trestle::measure::demo {

/// Opens a page in the user's browser, where there is a screen and xdg-open. Does not wait for it.
void open_in_browser(const std::string& url);

}  // namespace trestle::measure::demo
