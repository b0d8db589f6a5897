# cmake -DOUTPUT=file.cpp -DHEADER=kernel_sources.h -DTYPE=clarus::ocl::KernelFile -DFUNCTION=clarus::ocl::kernel_files
#       "-DFILES=a.cl;b.cl;common.clh" -P embed.cmake
# FUNCTION returns a std::span of TYPE, which has a name and a text. A compiler may limit one literal to 64 KiB; adjacent
# literals join.
set(content "#include \"${HEADER}\"\n\nstd::span<const ${TYPE}> ${FUNCTION}() {\n    static const ${TYPE} files[] = {\n")
foreach(file ${FILES})
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(LENGTH "${text}" length)
  set(literals "")
  set(start 0)
  while(start LESS length)
    string(SUBSTRING "${text}" ${start} 8000 piece)
    string(APPEND literals "R\"__TEXT__(${piece})__TEXT__\" ")
    math(EXPR start "${start} + 8000")
  endwhile()
  string(APPEND content "        {\"${name}\", ${literals}},\n")
endforeach()
string(APPEND content "    };\n    return files;\n}\n")
file(WRITE ${OUTPUT} "${content}")
