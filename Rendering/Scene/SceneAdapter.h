// SPDX-License-Identifier: BSD-3-Clause
/**
 * VTK's camera, lights, mappers and threads in the core's terms. Internal to the module.
 */
#pragma once

#include "Core/Base/Executor.h"
#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"
#include "Core/Surfels/SurfelCloud.h"

#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <string>
#include <vector>

class vtkCamera;
class vtkDataArray;
class vtkLightCollection;
class vtkMatrix4x4;
class vtkProperty;
class vtkSurfelMapper;

namespace SurfelSplatting
{
/// The core's threads are vtkSMPTools'.
class SMPExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override;
};

/// Any view and projection of vtkCamera whose image plane is not sheared: view angle, window centre
/// (tiles), parallel. The clipping range is left open.
View MakeView(vtkCamera* camera, const int size[2], double aspect);

/// A camera's lens: FocalDisk is its diameter; a FocalDistance of 0 is the distance to the focal
/// point.
Lens MakeLens(vtkCamera* camera);

/// Lights that are switched on, in camera space. Headlights and camera lights follow the camera.
std::vector<Light> MakeLights(vtkLightCollection* lights, vtkCamera* camera, const View& view);

/// A cloud's arrays, kept alive for as long as the core reads them.
struct SurfelCloudSource
{
  SurfelCloud Cloud;
  std::vector<vtkSmartPointer<vtkDataArray>> Arrays;
};

/**
 * The surfels of an updated mapper. Returns an empty string, or what is missing from the input and
 * what to do.
 * @param paperDetail whether the paper's rule is to choose the level of detail
 * @param linearLight whether byte colours and those of the property are sRGB codes of light
 */
std::string MakeCloud(vtkSurfelMapper* mapper, vtkMatrix4x4* actorMatrix, vtkProperty* property,
  bool paperDetail, bool linearLight, SurfelCloudSource& source);
}
