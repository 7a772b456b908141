// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkVolumeSplatting
 * @brief   turns a volume, or particles, into Gaussians in space
 *
 * The input is a vtkImageData with scalars at its points, or a vtkPointSet of particles with
 * scalars and a radius. The colours and opacities of VolumeProperty classify the scalars. The
 * output has GaussianCovariance, GaussianExtinction and colours (Documentation/DataContract.md);
 * empty space has no Gaussians. Time and memory are in proportion to what is not empty.
 *
 * Extinction is s = -ln(1 - o) / ScalarOpacityUnitDistance. Opacities o above 1 - 2^-16 count as
 * that. The first component of the scalars counts. With IndependentComponentsOff() of the property,
 * four components of an image are a colour and a scalar, as for VTK's volume mappers: the first
 * three are red, green and blue, from 0 to 255 as unsigned char, to 65535 as unsigned short, else
 * to 1, and the opacity function and the gradient are those of the fourth.
 *
 * Volumes: each cell becomes one Gaussian with the mass, the place, the shape and the colour of the
 * extinction in it, or eight, where the classified scalars change much within it (Subdivision).
 * Scalars are always interpolated linearly, whatever the property says, and classified afterwards.
 * In a homogeneous volume the Gaussians add up to 1 within 4.4 %; anisotropic spacing and direction
 * matrix count. Cells at a scalar that is not finite are empty, as are hidden cells.
 * CellGaussians.h has the formulas.
 *
 * Particles: a Gaussian whose standard deviation is the radius, and whose extinction at the centre
 * is that of the scalar.
 *
 * With ShadeOn() of the property, volumes get GaussianNormal: unit normals of the points, opposite
 * to the gradient of the scalar by central differences, interpolated, and their mean over the
 * Gaussian. At the faces of the whole image (the pipeline's whole extent) the outside counts as
 * what is transparent, where the opacity function has one transparent range: the cut through an
 * object has the normal of the face. GradientArrayName takes the gradient of another array.
 * vtkSurfelMapper shades such Gaussians by the property of the actor, see CopyMaterial(). The
 * lights are those of the scene, the side that faces the camera is lit, and highlights use the half
 * vector, as with VTK's volume mappers. Particles are not shaded (a warning).
 *
 * Gradient opacity is not supported (a warning), nor are dependent components of particles, or
 * other than four (an error).
 *
 * The result does not depend on the number of threads.
 *
 * @sa vtkSurfelMapper
 */
#ifndef vtkVolumeSplatting_h
#define vtkVolumeSplatting_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSmartPointer.h"        // for the property
#include "vtkSurfelVolumesModule.h" // for the export macro

class vtkDataArray;
class vtkImageData;
class vtkProperty;
class vtkVolumeProperty;

namespace SurfelVolumes
{
class GaussianCollection;
class TransferTable;
struct ImageScalars;
struct Particles;
}

class VTKSURFELVOLUMES_EXPORT vtkVolumeSplatting : public vtkPolyDataAlgorithm
{
public:
  static vtkVolumeSplatting* New();
  vtkTypeMacro(vtkVolumeSplatting, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The property with the transfer functions of colour and opacity and the unit distance of the
   * opacity. Default: none, which is an error.
   */
  void SetVolumeProperty(vtkVolumeProperty* property);
  vtkVolumeProperty* GetVolumeProperty();
  ///@}

  /**
   * Copies ambient, diffuse, specular and specular power of a volume's property to that of the
   * actor that shows its Gaussians. Highlights become white, since they have the colour of the
   * light.
   */
  static void CopyMaterial(vtkVolumeProperty* volumeProperty, vtkProperty* property);

  ///@{
  /**
   * How often a cell of a volume may be split into eight where the classified scalars change much
   * within it. Default 1, range 0 to 3. Each level sharpens surfaces and takes four to six times
   * as many Gaussians there.
   */
  vtkSetClampMacro(Subdivision, int, 0, 3);
  vtkGetMacro(Subdivision, int);
  ///@}

  ///@{
  /**
   * Name of the point array of a volume whose gradient gives the normals; of its components the
   * first counts. Default: none, which takes the scalars. Masks, whose gradients are those of a
   * staircase, are lit smoothly with their scalars smoothed by vtkImageGaussianSmooth here.
   */
  vtkSetStringMacro(GradientArrayName);
  vtkGetStringMacro(GradientArrayName);
  ///@}

  ///@{
  /**
   * Name of the point array with the radii of particles, world units, and the radius of all of them
   * if there is no name. Defaults: none and 0, which is an error for particles; range 0 to
   * infinity.
   */
  vtkSetStringMacro(RadiusArrayName);
  vtkGetStringMacro(RadiusArrayName);
  vtkSetClampMacro(Radius, double, 0.0, VTK_DOUBLE_MAX);
  vtkGetMacro(Radius, double);
  ///@}

  /**
   * Includes the time of the property and its functions.
   */
  vtkMTimeType GetMTime() override;

protected:
  vtkVolumeSplatting();
  ~vtkVolumeSplatting() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

  int Subdivision = 1;
  char* GradientArrayName = nullptr;
  char* RadiusArrayName = nullptr;
  double Radius = 0.0;

private:
  vtkVolumeSplatting(const vtkVolumeSplatting&) = delete;
  void operator=(const vtkVolumeSplatting&) = delete;

  bool CheckProperty(vtkDataArray* scalars, bool areOfImage);
#ifndef __VTK_WRAP__
  int SplatImage(vtkInformation* input, const SurfelVolumes::ImageScalars& scalars,
    const SurfelVolumes::TransferTable& table, vtkPolyData* output);
  int SplatParticles(const SurfelVolumes::Particles& particles,
    const SurfelVolumes::TransferTable& table, vtkPolyData* output);
  int Finish(bool done, SurfelVolumes::GaussianCollection& collection, const double origin[3],
    vtkPolyData* output);
#endif

  vtkSmartPointer<vtkVolumeProperty> VolumeProperty;
};

#endif
