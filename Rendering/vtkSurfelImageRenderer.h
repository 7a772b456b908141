// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelImageRenderer
 * @brief   surfels and a camera in, a picture out: no window, no OpenGL, no X server
 *
 * A source of vtkImageData with float RGBA. Its scene is the surfel actors that were added
 * (vtkActor with a vtkSurfelMapper) and any surfels connected to its optional input, which are
 * shown in their own colours, unlit. The output's point arrays: "Color" (scalars; float RGBA,
 * linear, premultiplied over the background) and "Depth" (float; distance along the view direction,
 * 0 where the alpha stays below one half). Row 0 is the bottom row.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelSplatter
 */
#ifndef vtkSurfelImageRenderer_h
#define vtkSurfelImageRenderer_h

#include "vtkImageAlgorithm.h"
#include "vtkNew.h"                   // for members
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro
#include "vtkSurfelSplatter.h"        // for its items

#include <vector> // for members

class vtkActor;
class vtkActorCollection;
class vtkCamera;
class vtkLight;
class vtkLightCollection;
class vtkSurfelMapper;

class VTKSURFELRENDERING_EXPORT vtkSurfelImageRenderer : public vtkImageAlgorithm
{
public:
  static vtkSurfelImageRenderer* New();
  vtkTypeMacro(vtkSurfelImageRenderer, vtkImageAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * The scene: actors whose mapper is a vtkSurfelMapper. Their property, matrix and visibility
   * count; others are left out with a warning.
   */
  void AddActor(vtkActor* actor);
  void RemoveActor(vtkActor* actor);
  void RemoveAllActors();
  vtkActorCollection* GetActors();
  ///@}

  ///@{
  /**
   * Lights for actors whose property is lit; without any there is one headlight, as in vtkRenderer.
   */
  void AddLight(vtkLight* light);
  void RemoveAllLights();
  vtkLightCollection* GetLights();
  ///@}

  ///@{
  /**
   * The camera; must be set. Its aspect is the picture's.
   */
  void SetCamera(vtkCamera* camera);
  vtkCamera* GetCamera();
  ///@}

  ///@{
  /**
   * Whether the clipping range is left open instead of being the camera's: nothing in front of the
   * lens is cut off. The camera itself is not changed. Default on.
   */
  vtkSetMacro(AutomaticClippingRange, vtkTypeBool);
  vtkGetMacro(AutomaticClippingRange, vtkTypeBool);
  vtkBooleanMacro(AutomaticClippingRange, vtkTypeBool);
  ///@}

  ///@{
  /**
   * Size of the picture in pixels. Default 512 x 512, range [1, 65536].
   */
  void SetSize(int width, int height);
  vtkGetVector2Macro(Size, int);
  ///@}

  ///@{
  /**
   * Background colour and its opacity. Default black, transparent: alpha is the coverage. Range [0,
   * inf), [0, 1].
   */
  vtkSetVector3Macro(Background, double);
  vtkGetVector3Macro(Background, double);
  vtkSetClampMacro(BackgroundAlpha, double, 0.0, 1.0);
  vtkGetMacro(BackgroundAlpha, double);
  ///@}

  /**
   * Lens, kernel and statistics.
   */
  vtkSurfelSplatter* GetSplatter();

  /**
   * Changes of the camera, the scene and the settings count.
   */
  vtkMTimeType GetMTime() override;

protected:
  vtkSurfelImageRenderer();
  ~vtkSurfelImageRenderer() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

private:
  vtkSurfelImageRenderer(const vtkSurfelImageRenderer&) = delete;
  void operator=(const vtkSurfelImageRenderer&) = delete;

  void BlendBackground(vtkImageData* picture);
#ifndef __VTK_WRAP__
  void AddInputs(vtkInformationVector* inputs, std::vector<vtkSurfelSplatter::Item>& items);
#endif

  vtkNew<vtkActorCollection> Actors;
  vtkNew<vtkLightCollection> Lights;
  vtkNew<vtkSurfelSplatter> Splatter;
  std::vector<vtkSmartPointer<vtkSurfelMapper>> InputMappers; // of the input port's connections
  vtkSmartPointer<vtkCamera> Camera;
  vtkTypeBool AutomaticClippingRange = 1;
  int Size[2] = { 512, 512 };
  double Background[3] = { 0.0, 0.0, 0.0 };
  double BackgroundAlpha = 0.0;
};

#endif
