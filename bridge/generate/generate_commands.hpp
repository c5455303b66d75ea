// bridge/generate: descriptions of interfaces at work.
//
//   source_options.hpp   sources on the command line
//   targets.hpp          all that it can be written as
//   output_folder.hpp    where it is written to; folder_lock.hpp: by one run at a time
//   capture_model.hpp    what a capture tells of a system
//   page.hpp             the page of `trestle generate --ui`: questions in, answers out. page_question.hpp,
//                        page_member.hpp and page_form.hpp are parts of it
//   page_server.hpp      serves it; page_caller.hpp: calls what it wants to try
//   explanation.hpp      what the bytes of a message are
//   generate_commands.hpp  the commands: generate, diff, explain
//
// docs/describe.md is the guide.
#pragma once

#include "bridge/generate/source_options.hpp"

namespace trestle::generate {

/// Each stores an exit status of bridge/cli/exit_status.hpp in `status`.
void add_generate_command(CLI::App& app, int& status, const SourceReaders& readers);
void add_diff_command(CLI::App& app, int& status, const SourceReaders& readers);
void add_explain_command(CLI::App& app, int& status, const SourceReaders& readers);

}  // namespace trestle::generate
