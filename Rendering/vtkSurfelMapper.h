// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelMapper
 * @brief   makes an actor of surfels
 *
 * Put it into an ordinary vtkActor. Its input is a vtkPolyData with the arrays of
 * Documentation/DataContract.md (SurfelCovariance, SurfelAreaVector and so on: the output of
 * vtkSurfelEstimation and vtkSurfelNormalization), or a hierarchy of them (vtkSurfelHierarchy), of
 * which what the view needs is drawn. Colours come as in every mapper: scalars through
 * a lookup table, direct RGB(A) scalars, or the actor's property. Direct scalars of floats or
 * doubles are linear light as they are, also above 1. Opacity is the product of the property's, the
 * colour's and the array SurfelOpacity. Lighting is evaluated once per surfel;
 * vtkProperty::LightingOff() gives the colours as they are.
 *
 * vtkSurfelSplattingPass (in a window) and vtkSurfelImageRenderer (without) splat what it holds. In
 * a renderer without the pass, it draws each surfel as an opaque dot of about the right size.
 * Hardware selection (vtkHardwareSelector, vtkPropPicker) sees the same dots; vtkPointPicker works
 * on the input's points and knows no SurfelOrigin.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelImageRenderer vtkSurfelEstimation
 */
#ifndef vtkSurfelMapper_h
#define vtkSurfelMapper_h

#include "vtkNew.h"                // for members
#include "vtkOpenGLRenderWindow.h" // for the weak pointer
#include "vtkPolyDataMapper.h"
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro
#include "vtkWeakPointer.h"           // for members

#include <memory> // for members

namespace SurfelSplatting
{
class HierarchyCache;
}
class vtkDataArray;
class vtkFloatArray;
class vtkMatrix4x4;
class vtkPointGaussianMapper;
class vtkUnsignedCharArray;

class VTKSURFELRENDERING_EXPORT vtkSurfelMapper : public vtkPolyDataMapper
{
public:
  static vtkSurfelMapper* New();
  vtkTypeMacro(vtkSurfelMapper, vtkPolyDataMapper);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  /**
   * Draws dots, unless a pass splats the surfels of this frame.
   */
  void RenderPiece(vtkRenderer* renderer, vtkActor* actor) override;

  /**
   * The local origin of the input (field array SurfelOrigin): what to add to its points.
   */
  void GetOrigin(double origin[3]);

  ///@{
  /**
   * Point array with the ids that hardware selection is to give instead of those of the input's
   * points: those of the points that surfels come from. Default none.
   */
  vtkSetStringMacro(PointIdArrayName);
  vtkGetStringMacro(PointIdArrayName);
  ///@}

  ///@{
  /**
   * Set by a pass while it takes care of these surfels itself. Not for general use.
   */
  void SetSplatted(bool splatted) { this->Splatted = splatted; }
  bool GetSplatted() const { return this->Splatted; }
  ///@}

#ifndef __VTK_WRAP__
  /// Colours as they are, linear RGBA: of float or double point scalars of 3 or 4 components with
  /// direct scalars. Null where there are none and scalars are mapped to bytes.
  vtkFloatArray* GetDirectColors();

  /// The light that such bytes stand for, as sRGB, in floats; kept until they change.
  vtkFloatArray* GetLinearColors(vtkUnsignedCharArray* bytes);

  /// What is kept of an input that is a hierarchy.
  SurfelSplatting::HierarchyCache& GetHierarchyCache()
  {
    return *this->HierarchyCache;
  }
#endif

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
   * Bounds of the surfels' centres, local origin added, widened by the largest kernel's standard
   * deviation.
   */
  void ComputeBounds() override;

  /**
   * Never: splats take colours, not texture coordinates.
   */
  int CanUseTextureMapForColoring(vtkDataObject* input) override;

private:
  vtkSurfelMapper(const vtkSurfelMapper&) = delete;
  void operator=(const vtkSurfelMapper&) = delete;

  void RenamePoints(vtkHardwareSelector* selector, const std::vector<unsigned int>& pixeloffsets);
  void UpdatePreview(vtkRenderer* renderer, double scale);
  void ReleasePreview();
  double MeanSpacing();

  std::unique_ptr<SurfelSplatting::HierarchyCache> HierarchyCache;
  vtkSmartPointer<vtkPointGaussianMapper> Preview;
  vtkWeakPointer<vtkOpenGLRenderWindow> PreviewWindow;
  vtkNew<vtkActor> PreviewActor;
  vtkNew<vtkMatrix4x4> PreviewMatrix;
  vtkTimeStamp PreviewTime;
  double Spacing = 0.0;
  vtkTimeStamp SpacingTime;
  vtkTimeStamp BoundsTime;
  vtkSmartPointer<vtkFloatArray> DirectColors;
  vtkSmartPointer<vtkDataArray> DirectColorsSource;
  vtkTimeStamp DirectColorsTime;
  vtkSmartPointer<vtkFloatArray> LinearColors;
  vtkSmartPointer<vtkDataArray> LinearColorsSource;
  vtkTimeStamp LinearColorsTime;
  bool Splatted = false;
  char* PointIdArrayName = nullptr;
};

#endif
