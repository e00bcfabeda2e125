# Of each command in SOURCES (by |) its name and description, as rows of handed_over.cpp: from the `Command` that each
# registers, so that they stand in one place.
#   cmake -DSOURCES=a.cpp|b.cpp -DOUTPUT=names.inc -P command_names.cmake
string(REPLACE "|" ";" SOURCES "${SOURCES}")
set(rows "")
foreach(source IN LISTS SOURCES)
  file(READ ${source} text)
  string(REPLACE ";" "\\;" text "${text}")
  set(words "\"[^\"]*\"[ \n]*")
  if(NOT text MATCHES "const Command k[A-Za-z]+\\([ \n]*(\"[a-z-]+\"),[ \n]*((${words})+),")
    message(FATAL_ERROR "${source} registers no command")
  endif()
  string(APPEND rows "{${CMAKE_MATCH_1}, ${CMAKE_MATCH_2}, hand_over},\n")
endforeach()
string(REPLACE "\\;" ";" rows "${rows}")
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "${rows}" @ONLY)
