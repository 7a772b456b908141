// SPDX-License-Identifier: BSD-3-Clause
/**
 * Surfels as opaque dots, where no pass splats them: in other renderers, and for selection.
 * Internal to the module.
 */
#pragma once

#include <vtkNew.h>
#include <vtkOpenGLRenderWindow.h>
#include <vtkSmartPointer.h>
#include <vtkTimeStamp.h>
#include <vtkWeakPointer.h>

#include <vector>

class vtkActor;
class vtkHardwareSelector;
class vtkMatrix4x4;
class vtkPointGaussianMapper;
class vtkPolyDataMapper;
class vtkProp;
class vtkRenderer;
class vtkWindow;

namespace SurfelSplatting
{
class SurfelDots
{
public:
  SurfelDots();
  ~SurfelDots();
  SurfelDots(const SurfelDots&) = delete;
  void operator=(const SurfelDots&) = delete;

  /// Draws a dot of about the right size for each surfel of a mapper's input, which has points.
  /// @param isColored whether the mapper's scalars are colours; else those of the property
  void Render(vtkPolyDataMapper* mapper, bool isColored, vtkRenderer* renderer, vtkActor* actor);

  /// Finds the points that a selection sees. Returns false if no dots were drawn.
  bool ProcessSelectorPixelBuffers(
    vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop);

  /// Releases the graphics resources. @param releasing window whose context is current, if any
  void Release(vtkWindow* releasing = nullptr);

private:
  void Update(vtkPolyDataMapper* mapper, bool isColored, vtkRenderer* renderer, double scale);
  void CopyInput(vtkPolyDataMapper* mapper);
  double MeanSpacing(vtkPolyDataMapper* mapper);

  vtkSmartPointer<vtkPointGaussianMapper> Mapper; // null: none drawn
  vtkWeakPointer<vtkOpenGLRenderWindow> Window;
  vtkWindow* Owner = nullptr; // the same also while it is being deleted
  vtkNew<vtkActor> Actor;
  vtkNew<vtkMatrix4x4> Matrix;
  double Origin[3] = { 0.0, 0.0, 0.0 }; // of the dots, beside the input's own
  vtkTimeStamp Time;                    // when they were made
  double Spacing = 0.0;                 // world units
  vtkTimeStamp SpacingTime;
};
}
