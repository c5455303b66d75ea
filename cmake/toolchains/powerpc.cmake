# A 32-bit big-endian target: Debian's g++-powerpc-linux-gnu; its programs run under qemu-ppc (package qemu-user).
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR ppc)
set(CMAKE_C_COMPILER powerpc-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER powerpc-linux-gnu-g++)
set(CMAKE_CXX_FLAGS_INIT "-Wno-psabi")  # no notes that GCC before 7.1 passed some arguments in another way
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")  # qemu-ppc needs no libraries of the target then
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-ppc)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
