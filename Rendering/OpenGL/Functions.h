// SPDX-License-Identifier: BSD-3-Clause
/**
 * OpenGL's functions and constants, from the loader that this VTK has: glad since 9.4, before it
 * glew.
 */
#pragma once

#if __has_include(<vtk_glad.h>)
#include <vtk_glad.h>
#else
#include <vtk_glew.h>
#endif
