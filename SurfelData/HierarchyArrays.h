// SPDX-License-Identifier: BSD-3-Clause
/**
 * The arrays that make surfels a hierarchy (Documentation/DataContract.md): checks and reads them.
 */
#pragma once

#include "Core/Hierarchy/HierarchyLayout.h"
#include "Core/Hierarchy/LeafPlacement.h"
#include "Core/Surfels/SurfelCloud.h"

#include <cstddef>
#include <string>

class vtkAbstractArray;
class vtkDataArray;
class vtkPolyData;
class vtkUnsignedCharArray;

namespace SurfelSplatting
{
/// Whether the input declares that it is a hierarchy (field array Arrays::Leaves).
bool IsHierarchy(vtkPolyData* input);

/// Returns an empty string, or why the input is no hierarchy that can be drawn.
std::string CheckHierarchy(vtkPolyData* input);

/// Numbers of leaves of what IsHierarchy; 0 if the array has not one for each tree.
HierarchyLayout ReadLayout(vtkPolyData* input);

/// Whether a hierarchy has as many points as leaves: filters that select points leave its nodes.
bool IsWhole(vtkPolyData* input);

/// The array of the nodes above the leaves; null if the input does not match its layout.
vtkUnsignedCharArray* FindNodes(vtkPolyData* input, const HierarchyLayout& layout);

/// The nodes of an input that passes CheckHierarchy.
const HierarchyNode* NodesOf(vtkPolyData* input, const HierarchyLayout& layout);

/// Where its points are, as seen from its nodes; of an input that passes CheckHierarchy.
/// @param leaves with the input's arrays
LeafPlacement FindPlacement(vtkPolyData* input, const SurfelCloud& leaves);

/// A field array with values that were computed from the surfels, as it is in files; null if there
/// is none of this type and size, or the surfels were modified after it.
/// @param tuples number of them
vtkDataArray* FindComputed(
  vtkPolyData* input, const char* name, std::size_t bytesPerTuple, std::size_t tuples);

/// Writes down which arrays the surfels have while their nodes are made: some may be removed, and
/// times do not tell that. In the name of the nodes' first component, which .vtp files keep.
void NoteSources(vtkPolyData* hierarchy);

/// Whether its surfels have other arrays than NoteSources has seen.
bool HaveOtherSources(vtkPolyData* hierarchy);

/// Whether any array that nodes are computed from, or that of the nodes, was modified after
/// another, added or removed.
bool IsOutdated(vtkPolyData* input, vtkAbstractArray* computed);
}
