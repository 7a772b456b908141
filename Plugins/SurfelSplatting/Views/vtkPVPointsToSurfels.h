// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkPVPointsToSurfels
 * @brief   vtkPointsToSurfels with settings that a panel can show
 *
 * Every other setting is the filters' default. Meshes whose vertices do not tell the surface, such
 * as those of CAD, are replaced by points on their faces.
 */
#ifndef vtkPVPointsToSurfels_h
#define vtkPVPointsToSurfels_h

#include "vtkPointsToSurfels.h"
#include "vtkSurfelViewsModule.h" // for export macro

class VTKSURFELVIEWS_EXPORT vtkPVPointsToSurfels : public vtkPointsToSurfels
{
public:
  static vtkPVPointsToSurfels* New();
  vtkTypeMacro(vtkPVPointsToSurfels, vtkPointsToSurfels);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  enum CleaningModes
  {
    CLEANING_OFF = 0,
    CLEANING_OUTLIERS = 1,
    CLEANING_FULL = 2
  };

  ///@{
  /**
   * How points are cleaned first, see vtkPointCloudCleaning: not at all, without moving points, or
   * with smoothing. Default CLEANING_FULL.
   */
  vtkSetClampMacro(CleaningMode, int, CLEANING_OFF, CLEANING_FULL);
  vtkGetMacro(CleaningMode, int);
  ///@}

  enum SidesModes
  {
    SIDES_AUTOMATIC = 0,
    SIDES_TWO = 1,
    SIDES_GIVEN = 2
  };

  ///@{
  /**
   * Which side of a surfel is outside: the one that faces the sensor, or as decided by
   * vtkSurfelEstimation if the sensor is unknown, but both of depth images; both; or the side of
   * the input's normals. Default SIDES_AUTOMATIC.
   */
  vtkSetClampMacro(SidesMode, int, SIDES_AUTOMATIC, SIDES_GIVEN);
  vtkGetMacro(SidesMode, int);
  ///@}

protected:
  vtkPVPointsToSurfels();
  ~vtkPVPointsToSurfels() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkPVPointsToSurfels(const vtkPVPointsToSurfels&) = delete;
  void operator=(const vtkPVPointsToSurfels&) = delete;

  int CleaningMode = CLEANING_FULL;
  int SidesMode = SIDES_AUTOMATIC;
};

#endif
