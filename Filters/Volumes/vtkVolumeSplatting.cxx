// SPDX-License-Identifier: BSD-3-Clause
#include "vtkVolumeSplatting.h"

#include "Filters/Arrays/InputArrays.h"
#include "Filters/Volumes/GaussianOutput.h"
#include "Filters/Volumes/ImageGaussians.h"
#include "Filters/Volumes/ParticleGaussians.h"
#include "Filters/Volumes/TransferTable.h"

#include "vtkDataArray.h"
#include "vtkDataObject.h"
#include "vtkDataSetAttributes.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPolyData.h"
#include "vtkProperty.h"
#include "vtkStreamingDemandDrivenPipeline.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <array>
#include <string>

using namespace SurfelVolumes;
using SurfelGeometry::StageProgress;

namespace
{
/// Whether a gradient opacity is other than 1. VTK's mappers make one of 1 where there is none.
bool DependsOnGradient(vtkVolumeProperty* property)
{
  if (!property->HasGradientOpacity(0))
  {
    return false;
  }
  vtkPiecewiseFunction* opacity = property->GetGradientOpacity(0);
  double node[4]; // place, value, midpoint, sharpness
  bool depends = false;
  for (int i = 0; i < opacity->GetSize(); ++i)
  {
    depends = depends || (opacity->GetNodeValue(i, node) == 1 && node[1] != 1.0);
  }
  return depends;
}

/// Which faces of an image are those of the whole image, of which it may be a piece.
std::array<bool, 6> FindEnds(vtkInformation* input, vtkImageData* image)
{
  int extent[6];
  image->GetExtent(extent);
  int whole[6];
  std::copy_n(extent, 6, whole);
  if (input->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
  {
    input->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), whole);
  }
  std::array<bool, 6> areEnds;
  std::transform(extent, extent + 6, whole, areEnds.begin(), std::equal_to<int>());
  return areEnds;
}
}

vtkStandardNewMacro(vtkVolumeSplatting);

vtkVolumeSplatting::vtkVolumeSplatting()
{
  this->SetInputArrayToProcess(
    0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_POINTS, vtkDataSetAttributes::SCALARS);
}

vtkVolumeSplatting::~vtkVolumeSplatting()
{
  this->SetRadiusArrayName(nullptr);
  this->SetGradientArrayName(nullptr);
}

void vtkVolumeSplatting::SetVolumeProperty(vtkVolumeProperty* property)
{
  if (this->VolumeProperty != property)
  {
    this->VolumeProperty = property;
    this->Modified();
  }
}

vtkVolumeProperty* vtkVolumeSplatting::GetVolumeProperty()
{
  return this->VolumeProperty;
}

void vtkVolumeSplatting::CopyMaterial(vtkVolumeProperty* volumeProperty, vtkProperty* property)
{
  if (!volumeProperty || !property)
  {
    vtkGenericWarningMacro("CopyMaterial needs two properties, and one is missing.");
    return;
  }
  property->SetAmbient(volumeProperty->GetAmbient());
  property->SetDiffuse(volumeProperty->GetDiffuse());
  property->SetSpecular(volumeProperty->GetSpecular());
  property->SetSpecularPower(volumeProperty->GetSpecularPower());
  property->SetSpecularColor(1.0, 1.0, 1.0);
}

vtkMTimeType vtkVolumeSplatting::GetMTime()
{
  const vtkMTimeType time = this->Superclass::GetMTime();
  return this->VolumeProperty ? std::max(time, this->VolumeProperty->GetMTime()) : time;
}

int vtkVolumeSplatting::FillInputPortInformation(int, vtkInformation* info)
{
  info->Set(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkImageData");
  info->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkPointSet");
  return 1;
}

bool vtkVolumeSplatting::CheckProperty(vtkDataArray* scalars, bool areOfImage)
{
  vtkVolumeProperty* property = this->VolumeProperty;
  if (!property)
  {
    vtkErrorMacro("There is no property: set one with SetVolumeProperty().");
    return false;
  }
  // Extinctions must fit into floats.
  const double unit = property->GetScalarOpacityUnitDistance(0);
  if (!(unit >= 1e-30 && unit <= 1e30))
  {
    vtkErrorMacro("The property has the unit distance "
      << unit << ": set one from 1e-30 to 1e30 with SetScalarOpacityUnitDistance().");
    return false;
  }
  const int components = scalars->GetNumberOfComponents();
  if (!property->GetIndependentComponents() && components > 1 && !(areOfImage && components == 4))
  {
    vtkErrorMacro("The " << components
                         << " components of the scalars are dependent, and only four of an image "
                            "can be: extract one with vtkImageExtractComponents.");
    return false;
  }
  if (DependsOnGradient(property))
  {
    vtkWarningMacro("The gradient opacity of the property has no effect.");
  }
  return true;
}

int vtkVolumeSplatting::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector* outputVector)
{
  vtkPolyData* output = vtkPolyData::GetData(outputVector, 0);
  vtkImageData* image = vtkImageData::GetData(inputVector[0], 0);
  vtkPointSet* points = vtkPointSet::GetData(inputVector[0], 0);
  vtkDataArray* scalars = this->GetInputArrayToProcess(0, inputVector);
  GaussianCollection none(false);
  const double zero[3] = { 0.0, 0.0, 0.0 };
  if (points && points->GetNumberOfPoints() == 0)
  {
    return this->Finish(true, none, zero, output);
  }
  const Particles particles{ points, scalars,
    points && this->RadiusArrayName ? points->GetPointData()->GetArray(this->RadiusArrayName)
                                    : nullptr,
    this->Radius };
  const std::string problem =
    image ? CheckImage(image, scalars) : CheckParticles(particles, this->RadiusArrayName);
  if (!problem.empty())
  {
    vtkErrorMacro(<< problem);
    return 0;
  }
  if (!this->CheckProperty(scalars, image != nullptr))
  {
    return 0;
  }
  const ImageScalars given{ scalars,
    !this->VolumeProperty->GetIndependentComponents() && scalars->GetNumberOfComponents() == 4 };
  double range[2];
  scalars->GetFiniteRange(range, ClassifiedComponent(given));
  if (!(range[0] <= range[1]))
  {
    vtkWarningMacro("None of the scalars is finite: no Gaussians were made.");
    return this->Finish(true, none, zero, output);
  }
  TransferTable::LimitToFunctions(this->VolumeProperty, range);
  const TransferTable table(
    this->VolumeProperty, range, this->VolumeProperty->GetScalarOpacityUnitDistance(0));
  return image ? this->SplatImage(inputVector[0]->GetInformationObject(0), given, table, output)
               : this->SplatParticles(particles, table, output);
}

int vtkVolumeSplatting::SplatImage(vtkInformation* input, const ImageScalars& scalars,
  const TransferTable& table, vtkPolyData* output)
{
  vtkImageData* image = vtkImageData::GetData(input);
  const bool isShaded = this->VolumeProperty->GetShade(0) != 0;
  vtkDataArray* gradients = this->GradientArrayName
    ? image->GetPointData()->GetArray(this->GradientArrayName)
    : scalars.Array;
  const bool areGradients =
    gradients && gradients->GetNumberOfTuples() == image->GetNumberOfPoints();
  if (isShaded && !areGradients)
  {
    vtkErrorMacro("The points have no array '"
      << this->GradientArrayName
      << "' with a value for each: choose one with SetGradientArrayName().");
    return 0;
  }
  const NormalSource normals{ gradients, OutsideScalar(this->VolumeProperty->GetScalarOpacity(0)),
    FindEnds(input, image) };
  ImageScalars sources = scalars;
  sources.Normals = isShaded ? &normals : nullptr;
  GaussianCollection collection(isShaded);
  const StageProgress progress(this, 0.0, 0.95);
  const bool done = CollectImage(image, sources, table, this->Subdivision, progress, collection);
  double origin[3];
  FindCenter(image, origin);
  return this->Finish(done, collection, origin, output);
}

int vtkVolumeSplatting::SplatParticles(
  const Particles& particles, const TransferTable& table, vtkPolyData* output)
{
  // Positions stay as they are, unless float would round them.
  double origin[3] = { 0.0, 0.0, 0.0 }, inputOrigin[3];
  if (particles.Points->GetPoints()->GetDataType() == VTK_DOUBLE)
  {
    FindFiniteCenter(particles.Points, origin);
  }
  SurfelGeometry::ReadOrigin(particles.Points, inputOrigin);
  if (this->VolumeProperty->GetShade(0))
  {
    vtkWarningMacro("Particles are not shaded: ShadeOn() of the property has no effect on them.");
  }
  GaussianCollection collection(false);
  vtkIdType unusable = 0;
  const StageProgress progress(this, 0.0, 0.95);
  const bool done = CollectParticles(particles, table, origin, progress, collection, unusable);
  for (int k = 0; k < 3; ++k)
  {
    origin[k] += inputOrigin[k];
  }
  const std::string message = SurfelGeometry::ListCounts({ { unusable, "particle",
    "left out: place, scalar and radius must be finite, and the radius above 0" } });
  if (done && !message.empty())
  {
    vtkWarningMacro(<< message << '.');
  }
  return this->Finish(done, collection, origin, output);
}

int vtkVolumeSplatting::Finish(
  bool done, GaussianCollection& collection, const double origin[3], vtkPolyData* output)
{
  if (!done)
  {
    if (!collection.Error().empty())
    {
      vtkErrorMacro(<< collection.Error());
      return 0;
    }
    return 1; // stopped by the user: empty output
  }
  collection.Write(origin, output);
  this->UpdateProgress(1.0);
  return 1;
}

void vtkVolumeSplatting::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "VolumeProperty: " << this->VolumeProperty.GetPointer() << "\n";
  os << indent << "Subdivision: " << this->Subdivision << "\n";
  os << indent
     << "GradientArrayName: " << (this->GradientArrayName ? this->GradientArrayName : "(none)")
     << "\n";
  os << indent << "RadiusArrayName: " << (this->RadiusArrayName ? this->RadiusArrayName : "(none)")
     << "\n";
  os << indent << "Radius: " << this->Radius << "\n";
}
