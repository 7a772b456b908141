// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelImageRenderer
 * @brief   renders a picture of surfels without window, OpenGL or X server
 *
 * This source of vtkImageData renders surfel actors (vtkActor with a vtkSurfelMapper) and any
 * surfels connected to its optional input, which are shown in their own colours, unlit. The output
 * is that of the splatter (vtkSurfelSplatter::GetOutput), with "Color" over the background.
 *
 * The second output has the same picture as "Color8" (scalars; unsigned char RGB): 255 times the
 * values, rounded, over black where the picture is transparent; linear light becomes sRGB. Writers
 * of .png and .jpg files take it: writer->SetInputConnection(renderer->GetOutputPort(1)). It is
 * made for connections and by Update(1); otherwise Update() leaves it empty.
 *
 * @sa vtkSurfelSplattingPass vtkSurfelSplatter
 */
#ifndef vtkSurfelImageRenderer_h
#define vtkSurfelImageRenderer_h

#include "vtkImageAlgorithm.h"
#include "vtkNew.h"                   // for members
#include "vtkSmartPointer.h"          // for members
#include "vtkSurfelRenderingModule.h" // for export macro
#include "vtkSurfelSplatter.h"        // for members

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
   * The actors of the scene; their mapper must be a vtkSurfelMapper. Property, matrix and
   * visibility are respected. Other actors are left out with a warning.
   */
  void AddActor(vtkActor* actor);
  void RemoveActor(vtkActor* actor);
  void RemoveAllActors();
  vtkActorCollection* GetActors();
  ///@}

  ///@{
  /**
   * Lights for actors with lighting on. Without any there is one headlight, as in vtkRenderer.
   */
  void AddLight(vtkLight* light);
  void RemoveAllLights();
  vtkLightCollection* GetLights();
  ///@}

  ///@{
  /**
   * The camera; must be set. Default none.
   */
  void SetCamera(vtkCamera* camera);
  vtkCamera* GetCamera();
  ///@}

  ///@{
  /**
   * Whether to ignore the camera's clipping range, so that nothing in front of the lens is cut off.
   * The camera is not changed. Default on.
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
   * Background colour, in the same colours as those of the surfels, and its opacity. Default black
   * and transparent (0): alpha is then the coverage. Ranges [0, inf) and [0, 1].
   */
  vtkSetVector3Macro(Background, double);
  vtkGetVector3Macro(Background, double);
  vtkSetClampMacro(BackgroundAlpha, double, 0.0, 1.0);
  vtkGetMacro(BackgroundAlpha, double);
  ///@}

  /**
   * The splatter: settings of lens and kernels, and statistics.
   */
  vtkSurfelSplatter* GetSplatter();

  /**
   * The time of the last change of camera, scene or settings.
   */
  vtkMTimeType GetMTime() override;

  vtkTypeBool ProcessRequest(
    vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

protected:
  vtkSurfelImageRenderer();
  ~vtkSurfelImageRenderer() override;

  int FillInputPortInformation(int port, vtkInformation* info) override;
  int RequestInformation(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;
  int RequestData(vtkInformation*, vtkInformationVector**, vtkInformationVector*) override;

private:
  vtkSurfelImageRenderer(const vtkSurfelImageRenderer&) = delete;
  void operator=(const vtkSurfelImageRenderer&) = delete;

  bool HasPicture(vtkInformation* output);
  bool Draw(vtkInformationVector* inputs, vtkImageData* picture);
  void BlendBackground(vtkImageData* picture);
  void RoundToBytes(vtkImageData* picture, vtkImageData* bytes);
#ifndef __VTK_WRAP__
  void AddInputs(vtkInformationVector* inputs, vtkSurfelSplatter::SceneItems& items);
  vtkSurfelSplatter::SceneView MakeView(const vtkSurfelSplatter::SceneItems& items);
#endif

  vtkNew<vtkActorCollection> Actors;
  vtkNew<vtkLightCollection> Lights;
  vtkNew<vtkLightCollection> Headlight; // alone
  vtkNew<vtkSurfelSplatter> Splatter;
  std::vector<vtkSmartPointer<vtkSurfelMapper>> InputMappers; // of the input port's connections
  vtkSmartPointer<vtkCamera> Camera;
  vtkTypeBool AutomaticClippingRange = 1;
  int Size[2] = { 512, 512 };
  double Background[3] = { 0.0, 0.0, 0.0 };
  double BackgroundAlpha = 0.0;
};

#endif
