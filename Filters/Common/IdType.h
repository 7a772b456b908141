// SPDX-License-Identifier: BSD-3-Clause
/**
 * VTK's type of ids, as its builds with ids of 64 bits have it, for files that are compiled without
 * VTK's headers (Filters/Points.cmake). With another VTK the compiler says that the two differ.
 */
#pragma once

typedef long long vtkIdType;
