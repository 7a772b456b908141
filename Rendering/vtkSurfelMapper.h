// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelMapper
 * @brief   draws surfels as an actor
 *
 * This mapper gives surfels to an ordinary vtkActor. Its input is a vtkPolyData with the arrays of
 * Documentation/DataContract.md (SurfelCovariance, SurfelAreaVector and so on: the output of
 * vtkSurfelEstimation and vtkSurfelNormalization), or a hierarchy of surfels (vtkSurfelHierarchy),
 * of which only the nodes that the view needs are drawn. Colours come as in every mapper: scalars
 * through a lookup table, direct RGB(A) scalars, or the actor's property. Direct scalars of type
 * float or double are taken as they are and may be above 1. Opacity is the product of the
 * property's opacity, the colour's alpha and the array SurfelOpacity. Lighting is evaluated once
 * per surfel; vtkProperty::LightingOff() shows the colours unlit.
 *
 * Gaussians in space (GaussianCovariance: the output of vtkGaussianSplatReader and
 * vtkVolumeSplatting) are drawn as well, with or without a hierarchy. They have no sides, and only
 * volumes with GaussianNormal are lit. Scalars give their colours; without scalars, or with
 * ScalarVisibilityOff(), the array GaussianHarmonics does.
 *
 * vtkSurfelSplattingPass (in a window) and vtkSurfelImageRenderer (without one) splat the surfels.
 * In a renderer without the pass, the mapper draws each surfel as an opaque dot of about the right
 * size, and warns once; dots of Gaussians do not show harmonics. Hardware selection
 * (vtkHardwareSelector, vtkPropPicker) sees the same dots. vtkPointPicker works on the input's
 * points and ignores SurfelOrigin. Clipping planes cut dots, not splats.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelImageRenderer vtkSurfelEstimation
 */
#ifndef vtkSurfelMapper_h
#define vtkSurfelMapper_h

#include "vtkPolyDataMapper.h"
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro

#include <memory> // for members

namespace SurfelSplatting
{
class HierarchyCache;
class SurfelDots;
}
class vtkDataArray;
class vtkFloatArray;
class vtkUnsignedCharArray;

class VTKSURFELRENDERING_EXPORT vtkSurfelMapper : public vtkPolyDataMapper
{
public:
  static vtkSurfelMapper* New();
  vtkTypeMacro(vtkSurfelMapper, vtkPolyDataMapper);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /**
   * Draws dots, unless a pass splats the surfels in this frame.
   */
  void RenderPiece(vtkRenderer* renderer, vtkActor* actor) override;

  /**
   * Gets the local origin of the input (field array SurfelOrigin), which is added to its points;
   * (0, 0, 0) if there is none. World units.
   */
  void GetOrigin(double origin[3]);

  ///@{
  /**
   * Whether surfels that have an outside are drawn from their backs, too, such as the walls of a
   * tunnel when the camera is inside. Surfels with two sides always are. Default false.
   */
  vtkSetMacro(ShowBacks, vtkTypeBool);
  vtkGetMacro(ShowBacks, vtkTypeBool);
  vtkBooleanMacro(ShowBacks, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Name of the point array with the ids that hardware selection returns instead of the ids of the
   * input's points, such as the ids of the points that the surfels were made from. Default none.
   */
  vtkSetStringMacro(PointIdArrayName);
  vtkGetStringMacro(PointIdArrayName);
  ///@}

  ///@{
  /**
   * Name of the point array with the flat index of the block that hardware selection returns for a
   * point: for clouds that were made from several blocks. Default none.
   */
  vtkSetStringMacro(CompositeIdArrayName);
  vtkGetStringMacro(CompositeIdArrayName);
  ///@}

  ///@{
  /**
   * Whether a pass splats the surfels of the current frame, so that no dots are drawn. Set by
   * passes; not for general use. Default false.
   */
  void SetSplatted(bool splatted) { this->Splatted = splatted; }
  bool GetSplatted() const { return this->Splatted; }
  ///@}

#ifndef __VTK_WRAP__
  /**
   * The colours of the current frame: RGBA of each surfel, a vtkUnsignedCharArray or a
   * vtkFloatArray. Null if the actor's property colours all surfels.
   * @param linearLight whether byte colours are sRGB codes, to be converted to light
   */
  vtkDataArray* GetFrameColors(bool linearLight);

  /// Data of a hierarchy, kept from frame to frame.
  SurfelSplatting::HierarchyCache& GetHierarchyCache()
  {
    return *this->HierarchyCache;
  }
#endif

  void ShallowCopy(vtkAbstractMapper* mapper) override;
  void ReleaseGraphicsResources(vtkWindow* window) override;
  bool GetSupportsSelection() override
  {
    return true;
  }
  void ProcessSelectorPixelBuffers(
    vtkHardwareSelector* selector, std::vector<unsigned int>& pixeloffsets, vtkProp* prop) override;

protected:
  vtkSurfelMapper();
  ~vtkSurfelMapper() override;

  /**
   * Computes the bounds of the surfels' centres, with the local origin added, widened by the
   * standard deviation of the largest kernel; each Gaussian in space by its own.
   */
  void ComputeBounds() override;

  /**
   * Returns 0: splats take colours, not texture coordinates.
   */
  int CanUseTextureMapForColoring(vtkDataObject* input) override;

private:
  vtkSurfelMapper(const vtkSurfelMapper&) = delete;
  void operator=(const vtkSurfelMapper&) = delete;

  vtkDataArray* GetChosenScalars(int& cellFlag);
  bool HasWrongScalars();
  void WarnOfNaN();
  vtkFloatArray* GetDirectColors();
  vtkFloatArray* GetLinearColors(vtkUnsignedCharArray* bytes);
  void RenamePoints(vtkHardwareSelector* selector, const std::vector<unsigned int>& pixeloffsets);
  void WarnOfDots(vtkRenderer* renderer);

  std::unique_ptr<SurfelSplatting::HierarchyCache> HierarchyCache;
  std::unique_ptr<SurfelSplatting::SurfelDots> Dots;
  vtkTimeStamp BoundsTime;
  vtkSmartPointer<vtkFloatArray> DirectColors;
  vtkSmartPointer<vtkDataArray> DirectColorsSource;
  vtkTimeStamp DirectColorsTime;
  vtkSmartPointer<vtkFloatArray> LinearColors;
  vtkSmartPointer<vtkDataArray> LinearColorsSource;
  vtkTimeStamp LinearColorsTime;
  vtkTimeStamp NaNTime; ///< when the scalars were last looked through
  bool Splatted = false;
  vtkTypeBool ShowBacks = false;
  bool HasWarnedOfDots = false, HasWarnedOfScalars = false, HasWarnedOfNaN = false;
  char* PointIdArrayName = nullptr;
  char* CompositeIdArrayName = nullptr;
};

#endif
