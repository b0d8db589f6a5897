# Adds to a target's sources one that holds files' contents: what embed.cmake makes. HEADER declares TYPE, a name and a
# content, and FUNCTION, which returns all of them.
function(clarus_embed target)
  cmake_parse_arguments(EMBED "" "HEADER;TYPE;FUNCTION" "FILES" ${ARGN})
  string(REGEX REPLACE ".*::" "" name ${EMBED_FUNCTION})
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  set(script ${PROJECT_SOURCE_DIR}/cmake/embed.cmake)
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${output} -DHEADER=${EMBED_HEADER} -DTYPE=${EMBED_TYPE}
            -DFUNCTION=${EMBED_FUNCTION} "-DFILES=${EMBED_FILES}" -P ${script}
    DEPENDS ${EMBED_FILES} ${script}
    VERBATIM)
  target_sources(${target} PRIVATE ${output})
endfunction()
