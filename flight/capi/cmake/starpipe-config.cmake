# find_package(starpipe) and target_link_libraries(PROGRAM PRIVATE starpipe::starpipe), or starpipe::static.
get_filename_component(_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET starpipe::starpipe)
    add_library(starpipe::starpipe SHARED IMPORTED)
    set_target_properties(starpipe::starpipe PROPERTIES
        IMPORTED_LOCATION "${_prefix}/lib/libstarpipe${CMAKE_SHARED_LIBRARY_SUFFIX}"
        IMPORTED_NO_SONAME TRUE
        INTERFACE_INCLUDE_DIRECTORIES "${_prefix}/include")
    add_library(starpipe::static STATIC IMPORTED)
    set_target_properties(starpipe::static PROPERTIES
        IMPORTED_LOCATION "${_prefix}/lib/libstarpipe.a"
        INTERFACE_INCLUDE_DIRECTORIES "${_prefix}/include"
        INTERFACE_LINK_LIBRARIES "pthread;dl;m")
endif()
unset(_prefix)
