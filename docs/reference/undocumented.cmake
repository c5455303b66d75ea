# Fails when a class, struct or enumeration has no comment. Doxygen can't be told to warn of these alone: asked for what is
# undocumented, it also names the members that their name and type explain.
# In: DOXYFILE, that of the reference.
set(all ${DOXYFILE}.undocumented)
file(WRITE ${all} "@INCLUDE = ${DOXYFILE}
OUTPUT_DIRECTORY = ${all}.out
EXTRACT_ALL = NO
WARN_IF_UNDOCUMENTED = YES
WARN_AS_ERROR = NO
GENERATE_HTML = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
")
execute_process(COMMAND doxygen ${all} ERROR_VARIABLE warnings OUTPUT_QUIET RESULT_VARIABLE result)
file(REMOVE_RECURSE ${all}.out)
if(result)
  message(FATAL_ERROR "doxygen ${all} ended with ${result}:\n${warnings}")
endif()
string(REGEX MATCHALL "[^\n]*(Compound [^\n]*|\\(enumeration\\) of [^\n]*) is not documented[^\n]*" missing "${warnings}")
if(missing)
  list(JOIN missing "\n" lines)
  message(FATAL_ERROR "These need a comment that says what they are:\n${lines}")
endif()
