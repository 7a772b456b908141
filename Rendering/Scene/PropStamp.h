// SPDX-License-Identifier: BSD-3-Clause
/**
 * Everything that the image of a renderer's other opaque props depends on, as numbers: with equal
 * stamps the image is the same and need not be drawn again to be compared. Internal to the module.
 */
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

class vtkActor;
class vtkCamera;
class vtkLightCollection;
class vtkMapper;
class vtkProp;
class vtkRenderer;

namespace SurfelSplatting
{
/// Whether any part of a prop is in 3D space and is not surfels.
/// @param opaqueOnly whether translucent parts do not count
bool IsOtherProp(vtkProp* prop, bool opaqueOnly);

/// Whether a prop is an actor that PropStamp knows. Such actors draw within their bounds, but for
/// the width of lines and points.
bool IsKnownActor(vtkActor* actor);

class PropStamp
{
public:
  /**
   * Updates the pipelines of the renderer's visible actors, and takes the MTimes and values that
   * VTK draws them from. Known are plain actors with the mappers vtkPolyDataMapper and
   * vtkDataSetMapper, without shaders of the user's, observers of their drawing, or textures. What
   * any other prop draws may depend on more.
   * @param drawn    [count] the props that pass the renderer's cullers
   * @param aspect   width / height for the camera's projection
   * @param settings MTime of all else that matters
   */
  void Take(vtkRenderer* renderer, const std::vector<vtkProp*>& drawn, double aspect,
    std::uint64_t settings);

  /// Forgets the last stamp.
  void Clear();

  /// Whether the last stamp tells all.
  bool IsKnown() const { return this->Known; }

  const std::vector<std::uint64_t>& Values() const { return this->Numbers; }

  /// The props that a frame of an equal stamp still has to draw: those that are not in it, such as
  /// text, which have nothing opaque in 3D space.
  const std::vector<vtkProp*>& OtherProps() const { return this->Others; }

  /// A renderer's MTime changes whenever it gets another camera for a while. Call before and after
  /// that: the time after stands for the same settings as the one before.
  void BeginCameraSwap(vtkRenderer* renderer);
  void EndCameraSwap(vtkRenderer* renderer);

private:
  void Add(double value);
  void AddRenderer(vtkRenderer* renderer, double aspect);
  void AddLights(vtkLightCollection* lights);
  bool AddActor(vtkActor* actor);
  void AddMapper(vtkMapper* mapper);
  std::uint64_t SettingsTime(vtkRenderer* renderer) const;

  std::vector<std::uint64_t> Numbers;
  std::unordered_map<vtkProp*, std::uint64_t> Stamped; // in which order
  std::vector<vtkProp*> Others;
  bool Known = false;
  std::uint64_t TimeBefore = 0, TimeAfter = 0; // MTimes of the renderer around its last swap
};
}
